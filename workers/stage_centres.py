"""Pairs matched again from the features of an earlier take, after a person has edited their ball centres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contract.features import FeaturePair
from contract.revision import CentreEdit, MovedCentre, RemovedCentre, RemovedTriad, TriadEdits
from spinewatch.detection import manual
from spinewatch.imaging.frame import Frame, Side
from spinewatch.pipeline import StageMeasurer
from spinewatch.progress import Progress
from spinewatch.stage import StageMeasurement, StageRequest
from spinewatch.triads.moved_triads import EarlierTriad, moved_triad_flags
from store.errors import FeaturesMissingError
from store.measurements import MeasuredStage
from workers.stage_decisions import Decision, decisions_of, excluded, removed_by


@dataclass(frozen=True, eq=False)
class EditedTake:
    """A take that is matched again from its features, with the edits of a person.

    Attributes
    ----------
    revised
        The result that is revised, and what its pairs were measured from.
    edits
        The edits; None when only the labels are to be found again.
    """

    revised: MeasuredStage
    edits: TriadEdits | None

    @cached_property
    def removed(self) -> list[RemovedTriad]:
        """Triads that persons removed."""
        return removed_by(self.revised.result, self.edits)

    @cached_property
    def decisions(self) -> list[Decision]:
        """Labels that stay with the triads at the same places."""
        return decisions_of(self.revised.result, self.edits)

    def measure(
        self,
        measurer: StageMeasurer,
        pair: int,
        frames: tuple[Frame, Frame],
        request: StageRequest,
        progress: Progress,
    ) -> StageMeasurement:
        """Return the triads of the edited features of a pair.

        Parameters
        ----------
        measurer
            The measurer of the rig, with the parameters of the take.
        pair
            Number of the pair, from 1.
        frames
            Its images.
        request
            Labels and spine axis.
        progress
            Called at the start of each step.

        Returns
        -------
        StageMeasurement
            The measurement; what detection says of the images is as it was.

        Raises
        ------
        FeaturesMissingError
            The features of the pair were not kept.
        """
        progress("detect", 0.0)
        detections = measurer.detect(*frames)
        centres = [] if self.edits is None else self.edits.centres
        of_pair = [edit for edit in centres if edit.pair == pair]
        changes = _of_side(of_pair, "left"), _of_side(of_pair, "right")
        detections = measurer.edit(detections, self._features(pair).library(), changes)
        without = replace(request, removed=excluded(self.removed))
        measurement = measurer.match(detections, frames, without, progress, explained=True)
        moved = moved_triad_flags(self._found_before(), [one.triad for one in measurement.triads])
        return replace(measurement, flags=(*measurement.flags, *moved))

    def _found_before(self) -> list[EarlierTriad]:
        """Return the triads of the take that were in full view without a placed centre; none of a burst."""
        if self.revised.result.burst is not None:
            return []
        found = []
        for triad in self.revised.result.triads:
            pose, balls = triad.pose(), triad.balls.values()
            left = [ball.left for ball in balls if ball.left is not None and not ball.manual]
            right = [ball.right for ball in balls if ball.right is not None and not ball.manual]
            if pose is not None and len(left) == len(right) == len(balls):
                found.append(EarlierTriad(pose, {"left": np.array(left), "right": np.array(right)}))
        return found

    def _features(self, pair: int) -> FeaturePair:
        if pair == 1:
            return self.revised.result.features
        found = self.revised.pairs[pair - 1].features if pair <= len(self.revised.pairs) else None
        if found is None:
            raise FeaturesMissingError(pair)
        return found.features


def _of_side(edits: Sequence[CentreEdit], side: Side) -> list[manual.CentreEdit]:
    return [
        manual.CentreEdit(
            edit.feature if isinstance(edit, MovedCentre | RemovedCentre) else None,
            None if isinstance(edit, RemovedCentre) else (edit.x, edit.y),
        )
        for edit in edits
        if edit.side == side
    ]
