"""What persons decided on triads, carried over to the triads of a stage that is matched again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

import spinewatch.flags
from contract.flag import Flag
from contract.revision import RemovedTriad, TriadEdits
from contract.stage import StageResult
from spinewatch.arrays import Float
from spinewatch.matching import exclusion
from spinewatch.stage import LABELS_UNCERTAIN, StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from store.measurements import MeasuredStage
from workers.stage_edits import TAKEN_AWAY, position_mm, removed_triads

_GIVEN_AWAY = "a person gave this label to another triad"


@dataclass(frozen=True, eq=False)
class Decision:
    """The label of a triad in an earlier take.

    Attributes
    ----------
    label
        The label; None when a person took it away.
    position_mm
        Where the triad is, shape (3,), mm.
    manual
        Whether a person decided on it; others count only where no label is found again.
    """

    label: str | None
    position_mm: Float
    manual: bool


def decisions_of(revised: StageResult, edits: TriadEdits | None) -> list[Decision]:
    """Return the labels of a take and those that its edits give.

    Parameters
    ----------
    revised
        The result that is revised.
    edits
        The edits; None when the labels are to be found again, so that only those of persons count.

    Returns
    -------
    list of Decision
        Those of persons first.
    """
    given = {} if edits is None else {edit.triad: edit.label for edit in edits.labels}
    removed = [] if edits is None else edits.removed
    found = []
    for place, triad in enumerate(revised.triads):
        at = position_mm(triad)
        manual = place in given or triad.label_manual
        label = given.get(place, triad.label)
        if at is None or place in removed or not (manual or (edits is not None and label is not None)):
            continue
        found.append(Decision(label, at, manual))
    return sorted(found, key=lambda decision: not decision.manual)


def removed_by(revised: StageResult, edits: TriadEdits | None) -> list[RemovedTriad]:
    """Return the triads that persons removed, in this revision and those before it.

    Parameters
    ----------
    revised
        The result that is revised.
    edits
        The edits, if any.

    Returns
    -------
    list of RemovedTriad
        Positions and ball images.
    """
    return [*revised.removed, *removed_triads(revised, [] if edits is None else edits.removed)]


def excluded(removed: Sequence[RemovedTriad]) -> tuple[exclusion.RemovedTriad, ...]:
    """Return the library's removed triads.

    Parameters
    ----------
    removed
        Triads that persons removed.

    Returns
    -------
    tuple of exclusion.RemovedTriad
        Their places and ball images.
    """
    return tuple(
        exclusion.RemovedTriad(
            None if one.position_mm is None else np.array(one.position_mm),
            np.array(one.left).reshape(-1, 2),
            np.array(one.right).reshape(-1, 2),
        )
        for one in removed
    )


def decide(
    measurement: StageMeasurement, decisions: Sequence[Decision], vertebrae: Sequence[str]
) -> StageMeasurement:
    """Return a pair with the labels that were decided on.

    Parameters
    ----------
    measurement
        The measurement of the pair, with the labels that were found.
    decisions
        Labels of an earlier take.
    vertebrae
        Labels in their order.

    Returns
    -------
    StageMeasurement
        The triads in the order of their labels, those without one last.
    """
    triads = list(measurement.triads)
    places = [triad.triad.position_mm for triad in triads]
    manual = [decision for decision in decisions if decision.manual]
    labels = _nearest(manual, places)
    given = {label for label in labels.values() if label is not None}
    for k, triad in enumerate(triads):
        if k in labels:
            reason = TAKEN_AWAY if labels[k] is None else None
            triads[k] = LabelledTriad(labels[k], reason, triad.triad)
        elif triad.label in given:
            triads[k] = LabelledTriad(None, _GIVEN_AWAY, triad.triad)
    used = {triad.label for triad in triads}
    others = [decision for decision in decisions if not decision.manual and decision.label not in used]
    for k, label in _nearest(others, places).items():
        if triads[k].label is None and k not in labels:
            triads[k] = LabelledTriad(label, None, triads[k].triad)
    order = {label: place for place, label in enumerate(vertebrae)}
    triads.sort(key=lambda triad: order.get(triad.label or "", len(order)))
    certain = all(triad.label is not None for triad in triads)
    flags = tuple(flag for flag in measurement.flags if not (certain and flag.code == LABELS_UNCERTAIN))
    return replace(measurement, triads=tuple(triads), flags=flags)


def decided(
    measured: MeasuredStage,
    decisions: Sequence[Decision],
    removed: Sequence[RemovedTriad],
    *,
    relabelled: bool = False,
) -> MeasuredStage:
    """Return a stage that was matched again with marks of what persons decided.

    Parameters
    ----------
    measured
        The stage, with the labels that were decided on.
    decisions
        Labels of an earlier take.
    removed
        Triads that persons removed.
    relabelled
        Whether the labels were found again because the stage that had decided on them was revised.

    Returns
    -------
    MeasuredStage
        Labels of persons are marked, flagged "edit-lost" where there is no triad at the place of one, and "labels-kept"
        where the others were found again.
    """
    result = measured.result
    manual = [decision for decision in decisions if decision.manual]
    found = {k: at for k, triad in enumerate(result.triads) if (at := position_mm(triad)) is not None}
    places = list(found)
    marked = _nearest(manual, [found[k] for k in places])
    of_person = {places[k]: label for k, label in marked.items()}
    triads = [
        triad.model_copy(update={"label_manual": True})
        if k in of_person and triad.label == of_person[k]
        else triad
        for k, triad in enumerate(result.triads)
    ]
    kept = [decision for decision in manual if _is_kept(decision, [found[k] for k in of_person])]
    lost = [decision for decision in manual if decision not in kept]
    changed = result.model_copy(
        update={
            "triads": triads,
            "flags": [*result.flags, *_lost_flags(lost), *(_kept_flags(kept) if relabelled else ())],
            "removed": list(removed),
        }
    )
    return replace(measured, result=changed)


def _nearest(decisions: Sequence[Decision], places: Sequence[Float]) -> Mapping[int, str | None]:
    """Return the label by number of the place that each decision belongs to: the nearest one, each once."""
    distances = sorted(
        (float(np.linalg.norm(decision.position_mm - place)), d, k)
        for d, decision in enumerate(decisions)
        for k, place in enumerate(places)
    )
    labels: dict[int, str | None] = {}
    done: set[int] = set()
    for distance, d, k in distances:
        if distance < exclusion.NEAR_MM and d not in done and k not in labels:
            labels[k] = decisions[d].label
            done.add(d)
    return labels


def _is_kept(decision: Decision, places: Sequence[Float]) -> bool:
    return any(np.linalg.norm(decision.position_mm - place) < exclusion.NEAR_MM for place in places)


def _kept_flags(kept: Sequence[Decision]) -> list[Flag]:
    if not kept:
        return []
    names = ", ".join(decision.label or "none" for decision in kept)
    detail = f"the stage that had decided on labels was revised; those that a person gave here stay: {names}"
    return Flag.of([spinewatch.flags.Flag("labels-kept", detail)])


def _lost_flags(lost: Sequence[Decision]) -> list[Flag]:
    return Flag.of(
        spinewatch.flags.Flag(
            "edit-lost",
            f"the triad that a person labelled {decision.label or 'as uncertain'} is not found after the edits of ball"
            " centres; look at the triads and their labels again",
        )
        for decision in lost
    )
