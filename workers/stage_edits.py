"""Edits of the labels and triads of a measured stage by a person; nothing is measured again."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from contract.flag import Flag
from contract.pair_result import PairResult
from contract.revision import RemovedTriad, TriadEdits
from contract.stage import StageResult
from contract.triad import Ball, Triad
from spinewatch.arrays import Float
from spinewatch.stage import LABELS_UNCERTAIN
from spinewatch.triads import pose
from spinewatch.triads.flags import TRIAD_FLAGS, triad_flags
from store.measurements import MeasuredStage
from workers.burst_edits import edit_burst

TAKEN_AWAY = "the label was taken away by a person"


def edited(
    measured: MeasuredStage, edits: TriadEdits, vertebrae: Sequence[str], reference: str
) -> MeasuredStage:
    """Return a result with the labels and without the triads that a person edited.

    Parameters
    ----------
    measured
        The result that is revised.
    edits
        Labels that are confirmed, changed or taken away, and triads that are left out.
    vertebrae
        Labels in their order.
    reference
        The reference vertebra.

    Returns
    -------
    MeasuredStage
        Triads in the order of their labels, those without one last. Of a burst the means are computed again. The flag
        of uncertain labels stays while a triad has none.
    """
    labels = {edit.triad: edit.label for edit in edits.labels}
    removed = [*measured.result.removed, *removed_triads(measured.result, edits.removed)]
    changed = relabelled(measured, labels, edits.removed, vertebrae, reference)
    return replace(changed, result=changed.result.model_copy(update={"removed": removed}))


def relabelled(
    measured: MeasuredStage,
    labels: Mapping[int, str | None],
    removed: Collection[int],
    vertebrae: Sequence[str],
    reference: str,
) -> MeasuredStage:
    """Return a result with other labels, and without some triads.

    Parameters
    ----------
    measured
        The result.
    labels
        Labels that a person decided on, by place of the triad; None takes the label away.
    removed
        Places of triads that are left out.
    vertebrae
        Labels in their order.
    reference
        The reference vertebra.

    Returns
    -------
    MeasuredStage
        Triads in the order of their labels, those without one last.
    """
    result = measured.result
    place = {label: number for number, label in enumerate(vertebrae)}
    kept = {
        index: _labelled(triad, labels[index]) if index in labels else triad
        for index, triad in enumerate(result.triads)
        if index not in removed
    }
    order = sorted(kept, key=lambda index: place.get(kept[index].label or "", len(place)))
    after = result.model_copy(
        update={
            "triads": [kept[index] for index in order],
            "flags": _flags(result, list(kept.values()), len(vertebrae)),
        }
    )
    if result.burst is not None:
        before = {index: triad.label for index, triad in enumerate(result.triads)}
        after = edit_burst(after, [before[index] for index in order], reference)
    places = {index: number for number, index in enumerate(order)}
    return MeasuredStage(after, tuple(_placed(pair, places) for pair in measured.pairs))


def removed_triads(result: StageResult, places: Collection[int]) -> list[RemovedTriad]:
    """Return what is remembered of triads that a person removes.

    Parameters
    ----------
    result
        The result that is revised.
    places
        Places of the triads.

    Returns
    -------
    list of RemovedTriad
        Positions and ball images.
    """
    return [
        RemovedTriad(
            position_mm=_listed(position_mm(triad)),
            left=[ball.left for ball in triad.balls.values() if ball.left is not None],
            right=[ball.right for ball in triad.balls.values() if ball.right is not None],
        )
        for triad in (result.triads[place] for place in places)
    ]


def position_mm(triad: Triad) -> Float | None:
    """Return where a triad is.

    Parameters
    ----------
    triad
        The triad.

    Returns
    -------
    Float or None
        Its position, or the mean of its balls without a pose, shape (3,), mm; None when it has neither.
    """
    if triad.position_mm is not None:
        return np.array(triad.position_mm)
    balls = [ball.position_mm for ball in triad.balls.values()]
    return np.mean(balls, axis=0) if balls else None


def _listed(position: Float | None) -> list[float] | None:
    return None if position is None else [float(x) for x in position]


def _labelled(triad: Triad, label: str | None) -> Triad:
    reason = TAKEN_AWAY if label is None else None
    return triad.model_copy(update={"label": label, "label_reason": reason, "label_manual": True})


def _flags(result: StageResult, kept: Sequence[Triad], expected: int) -> list[Flag]:
    """Return the flags of a result with the triads that are kept, in their order along the spine."""
    certain = all(triad.label is not None for triad in kept)
    flags = [flag for flag in result.flags if not (certain and flag.code == LABELS_UNCERTAIN)]
    if result.burst is not None or len(kept) == len(result.triads):
        return flags
    other = [flag for flag in flags if flag.code not in TRIAD_FLAGS]
    return [*Flag.of(triad_flags([measured_triad(triad) for triad in kept], expected)), *other]


def measured_triad(triad: Triad) -> pose.MeasuredTriad:
    """Return the library's triad, of which flags need the hidden balls and the pose.

    Parameters
    ----------
    triad
        The triad.

    Returns
    -------
    MeasuredTriad
        Its balls and its pose.
    """
    balls = {name: _ball(ball) for name, ball in triad.balls.items()}
    return pose.MeasuredTriad(triad.model, balls, triad.pose(), triad.error_mm, triad.reason)


def _ball(ball: Ball) -> pose.Ball:
    left, right = (None if image is None else np.array(image) for image in (ball.left, ball.right))
    covariance = np.diag(np.square(ball.sd_mm))
    return pose.Ball(
        np.array(ball.position_mm), covariance, left, right, ball.parallax_mm, tuple(ball.manual)
    )


def _placed(pair: PairResult, places: Mapping[int, int]) -> PairResult:
    if pair.explanation is None:
        return pair
    return pair.model_copy(update={"explanation": pair.explanation.placed(places)})
