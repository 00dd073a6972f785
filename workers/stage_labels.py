"""Labels of a stage's pairs: where triads are missing, a pair of the same burst or an earlier stage decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from contract.burst import LabelSource
from spinewatch.stage import LABELS_UNCERTAIN, StageMeasurement, StageRequest, relabelled
from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.pose import Pose
from store.stage_work import StageWork
from workers.registry import NotReadyError

_MIN_TRIADS = 2
"""Number of triads from which a known configuration can decide: it is one of distances."""


@dataclass(frozen=True, eq=False)
class LabelledPair:
    """A measured pair, and what decided on its labels.

    Attributes
    ----------
    measurement
        The measurement.
    labelled_by
        What decided on its labels; None if the pair itself did.
    """

    measurement: StageMeasurement
    labelled_by: LabelSource | None = None

    @property
    def poses(self) -> dict[str, Pose]:
        """Poses of the labelled triads by label."""
        found = ((triad.label, triad.triad.pose) for triad in self.measurement.triads)
        return {label: pose for label, pose in found if label is not None and pose is not None}


def label_pairs(
    measured: Sequence[StageMeasurement], request: StageRequest, work: StageWork
) -> list[LabelledPair]:
    """Return the pairs of a stage with labels, where they can be decided.

    Uncertain labels are decided by the first pair of the same burst that shows all labels, or else by the latest
    earlier stage whose result does.

    Parameters
    ----------
    measured
        Measurements of the pairs, labelled each by itself.
    request
        The request of the measurements.
    work
        The stage and the earlier ones.

    Returns
    -------
    list of LabelledPair
        One per measurement, in their order.

    Raises
    ------
    NotReadyError
        Labels are uncertain, and the job of an earlier stage that may decide on them has not ended.
    """
    pairs = [LabelledPair(measurement) for measurement in measured]
    if not any(map(_is_open, measured)):
        return pairs
    known, source = _known(pairs, request, work)
    if known is None:
        return pairs
    return [
        _decided(pair, replace(request, known=known), source) if _is_open(pair.measurement) else pair
        for pair in pairs
    ]


def _is_open(measurement: StageMeasurement) -> bool:
    """Return whether labels are uncertain and distances could decide on them."""
    uncertain = any(flag.code == LABELS_UNCERTAIN for flag in measurement.flags)
    return uncertain and len(measurement.triads) >= _MIN_TRIADS


def _known(
    pairs: Sequence[LabelledPair], request: StageRequest, work: StageWork
) -> tuple[KnownConfiguration | None, LabelSource | None]:
    """Return the configuration that decides, and where it comes from."""
    for number, pair in enumerate(pairs, start=1):
        poses = pair.poses
        if set(request.labels) == set(poses):
            return KnownConfiguration(poses=poses), LabelSource(stage=work.name, take=work.take, pair=number)
    if work.unended_job is not None:
        raise NotReadyError(work.unended_job)
    if work.labelled is None:
        return None, None
    earlier = work.labelled
    return KnownConfiguration(poses=earlier.poses), LabelSource(stage=earlier.name, take=earlier.take)


def _decided(pair: LabelledPair, request: StageRequest, source: LabelSource | None) -> LabelledPair:
    """Return the pair with the labels of the known configuration; as it was if that decides on none."""
    measurement = relabelled(pair.measurement, request)
    labelled = any(triad.label is not None for triad in measurement.triads)
    return LabelledPair(measurement, source if labelled else None)
