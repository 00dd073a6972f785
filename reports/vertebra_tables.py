"""Tables of the vertebrae: where each is, how it moved, and what remains to the target."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from contract.spine import SpineChange, StageSpine, VertebraChange, VertebraState
from reports.measure_text import with_interval, with_sd
from spinewatch.spine.configuration import Origin


@dataclass(frozen=True)
class TextTable:
    """A table of texts.

    Attributes
    ----------
    title
        Its title.
    columns
        Names of the columns.
    rows
        Texts, one a column.
    notes
        Sentences below it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


def vertebra_table(spine: StageSpine) -> TextTable:
    """Return where each vertebra is at a stage.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    TextTable
        Positions and tilts with their standard deviations; a vertebra without a pose has dashes and a reason.
    """
    rows, notes = [], []
    for state in spine.vertebrae:
        numbers = _state_numbers(state)
        rows.append((state.vertebra, state.origin.value.replace("_", " "), *(with_sd(*n) for n in numbers)))
        if state.reason or state.position_reason:
            notes.append(f"{state.vertebra}: {state.reason or state.position_reason}")
    columns = (
        "vertebra", "pose", "anterior mm", "left mm", "cephalad mm", "coronal tilt °", "sagittal tilt °",
        "axial rotation °",
    )  # fmt: skip
    return TextTable(f"Vertebrae at {spine.stage}", columns, tuple(rows), notes_by_reason(notes))


def _state_numbers(state: VertebraState) -> list[tuple[float | None, float | None]]:
    unknown = [None] * 3
    position = zip(state.position_mm or unknown, state.position_sd_mm or unknown, strict=True)
    return [
        *position,
        (state.coronal_tilt_deg, state.coronal_tilt_sd_deg),
        (state.sagittal_tilt_deg, state.sagittal_tilt_sd_deg),
        (state.axial_rotation_deg, state.axial_rotation_sd_deg),
    ]


def motion_table(stage: str, change: SpineChange) -> TextTable:
    """Return how each vertebra moved between two stages.

    Parameters
    ----------
    stage
        Name of the later stage.
    change
        The change.

    Returns
    -------
    TextTable
        Translations and rotations with their standard deviations, the angle with its 95% interval; a vertebra without a
        motion has dashes and a reason.
    """
    rows, notes = [], []
    for moved in change.vertebrae:
        *numbers, distraction = (with_sd(*number) for number in _motion_numbers(moved))
        angle = with_interval(moved.angle_deg, moved.angle_interval_deg)
        rows.append((moved.vertebra, moved.origin.value.replace("_", " "), *numbers, angle, distraction))
        if moved.reason:
            notes.append(f"{moved.vertebra}: {moved.reason}")
    columns = (
        "vertebra", "pose", "anterior mm", "left mm", "cephalad mm", "coronal °", "sagittal °", "derotation °",
        "angle ° (95%)", "distraction mm",
    )  # fmt: skip
    return TextTable(f"{stage} since {change.since.name}", columns, tuple(rows), notes_by_reason(notes))


def _motion_numbers(moved: VertebraChange) -> list[tuple[float | None, float | None]]:
    return [
        *zip(moved.translation_mm, moved.translation_sd_mm, strict=True),
        (moved.coronal_deg, moved.coronal_sd_deg),
        (moved.sagittal_deg, moved.sagittal_sd_deg),
        (moved.derotation_deg, moved.derotation_sd_deg),
        (moved.distraction_mm, moved.distraction_sd_mm),
    ]


def remaining_table(spine: StageSpine) -> TextTable | None:
    """Return what remains to the target at a stage.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    TextTable or None
        One row per planned vertebra; None without a target.
    """
    if spine.remaining is None:
        return None
    rows = []
    for left in spine.remaining:
        tilts = zip((left.coronal_deg, left.sagittal_deg, left.axial_deg), left.sd_deg, strict=True)
        moves = zip(left.translation_mm, left.translation_sd_mm, strict=True)
        rows.append((left.vertebra, *(with_sd(*number) for number in (*tilts, *moves))))
    columns = (
        "vertebra", "coronal °", "sagittal °", "axial °", "anterior mm", "left mm", "cephalad mm",
    )  # fmt: skip
    planned = all(value is not None for left in spine.remaining for value in left.translation_mm)
    notes = () if planned else ("A dash in a translation: the plan has no position for this vertebra.",)
    return TextTable(f"At {spine.stage}", columns, tuple(rows), notes)


def not_drawn(spine: StageSpine) -> str:
    """Return which vertebrae have no pose at a stage and so are in no drawing.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    str
        Their names; empty when all have one.
    """
    missing = [
        s.vertebra for s in spine.vertebrae if s.origin is Origin.NOT_MEASURED or s.position_mm is None
    ]
    return ", ".join(missing)


def notes_by_reason(notes: Iterable[str]) -> tuple[str, ...]:
    """Return notes with the vertebrae of the same reason together.

    Parameters
    ----------
    notes
        Notes as ``vertebra: reason``.

    Returns
    -------
    tuple of str
        One note per reason.

    Examples
    --------
    >>> notes_by_reason(["T5: it was not measured", "T6: it was not measured"])
    ('T5, T6: it was not measured',)
    """
    by_reason: dict[str, list[str]] = {}
    for note in notes:
        level, reason = note.split(": ", 1)
        by_reason.setdefault(reason, []).append(level)
    return tuple(f"{', '.join(levels)}: {reason}" for reason, levels in by_reason.items())
