"""All numbers of a stage as one list of entries, for the exports that take every number."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain

from contract.spine import Attribution, MeasureValue, StageSpine, VertebraChange, VertebraState
from exports.open_ends import open_ends
from spinewatch.spine import uncertainty
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus

_MILLIMETRES = ("position", "translation", "distraction")

_TILTS = ("coronal-tilt", "sagittal-tilt", "axial-rotation")
_MEASURES = (*_TILTS, "lateral-displacement")

Number = tuple[float | None, float | None]
"""A value with its standard deviation."""

_UNKNOWN: Number = (None, None)


@dataclass(frozen=True)
class Entry:
    """One number of an export, with everything that qualifies it.

    Attributes
    ----------
    subject
        ``spine``, the name of a curve, or a vertebra.
    kind
        Kind of the subject: ``spine``, ``curve`` or ``vertebra``.
    code
        Identifier of the definition, or a code of `COMPONENTS`.
    unit
        ``deg`` or ``mm``.
    value
        The value; None when not measured.
    sd
        Its standard deviation; None when unknown.
    interval
        Ends of its 95% interval; None when unknown.
    status
        A code of `STATUSES`.
    assumed
        Whether it depends on an assumed initial configuration.
    reason
        Why it is bracketed or not measured.
    levels
        Vertebrae that it belongs to, cranial first.
    derivation
        A code of `DERIVATIONS`; None for a value of the stage itself.
    since
        Name of the stage that a change is counted from.
    open_ends
        Ends of its curve at the end of the measured span: the curve may go on beyond.
    """

    subject: str
    kind: str
    code: str
    unit: str
    value: float | None
    sd: float | None
    interval: tuple[float, float] | None
    status: str
    assumed: bool
    reason: str | None
    levels: tuple[str, ...]
    derivation: str | None = None
    since: str | None = None
    open_ends: tuple[str, ...] = ()

    @property
    def identity(self) -> tuple[str | None, ...]:
        """What no other number of the stage has: subject, code, derivation, stage of comparison and vertebrae."""
        return (self.kind, self.subject, self.code, self.derivation, self.since, *self.levels)


def entries(spine: StageSpine) -> Iterator[Entry]:
    """Yield every number of a stage, in the same order for every export that takes all of them.

    Parameters
    ----------
    spine
        The spine at the stage. Changes since the stage before are given where that is not the baseline.

    Yields
    ------
    Entry
        Numbers of the spine, of its curves and of its vertebrae. A number that is not there is given with its reason,
        a vertebra without a pose or motion once as ``pose`` or ``motion``;
        one that is both a measure and part of a vertebra's state is given once. Subject, definition, vertebrae,
        derivation and stage of comparison together say which number it is: see `Entry.identity`.
    """
    measures = (_measure(measure) for measure in spine.measures)
    targets = (_measure(measure, "remaining") for measure in spine.target_measures or ())
    given = set()
    ends = open_ends(spine)
    for entry in chain(measures, targets, _states(spine), _remaining(spine), _changes(spine)):
        if entry.identity not in given:
            given.add(entry.identity)
            of_curve = ends.get(entry.subject, ()) if entry.kind == "curve" else ()
            yield replace(entry, open_ends=of_curve) if of_curve else entry


def normal_interval(value: float | None, sd: float | None) -> tuple[float, float] | None:
    """Return the 95% interval of a normally distributed value.

    Parameters
    ----------
    value
        The value; None when not measured.
    sd
        Its standard deviation; None when unknown.

    Returns
    -------
    tuple of float or None
        Lower and upper end, in the unit of the value.

    Examples
    --------
    >>> [round(end, 2) for end in normal_interval(10.0, 1.0)]
    [8.04, 11.96]
    """
    return None if value is None or sd is None else uncertainty.normal_interval(value, sd)


def angle_interval(moved: VertebraChange) -> tuple[float, float] | None:
    """Return the 95% interval of the angle of a rotation, which is never negative.

    Parameters
    ----------
    moved
        The motion; results of earlier versions have a standard deviation alone.

    Returns
    -------
    tuple of float or None
        Lower and upper end, degrees; None without a motion.
    """
    found = _ends(moved.angle_interval_deg)
    normal = normal_interval(moved.angle_deg, moved.angle_sd_deg)
    if found is not None or normal is None:
        return found
    return max(normal[0], 0.0), normal[1]


def _ends(interval: list[float | None] | None) -> tuple[float, float] | None:
    match interval:
        case [float() | int() as low, float() | int() as high]:
            return low, high
        case _:
            return None


def _measure(measure: MeasureValue, derivation: str | None = None, since: str | None = None) -> Entry:
    subject = measure.curve or "spine"
    kind = "curve" if measure.curve else "spine"
    if measure.curve is None and len(measure.levels) == 1:
        subject, kind = measure.levels[0], "vertebra"
    value = None if measure.status is MeasureStatus.NOT_MEASURED else measure.value
    status = measure.status.value if value is not None else "not_measured"
    return Entry(
        subject, kind, measure.definition, measure.unit, value, measure.sd if value is not None else None,
        _ends(measure.interval) if value is not None else None, status, measure.assumed, measure.reason,
        tuple(measure.levels), derivation, since,
    )  # fmt: skip


def _component(
    level: str,
    code: str,
    number: Number,
    origin: str,
    reason: str | None,
    derivation: str | None = None,
    since: str | None = None,
) -> Entry:
    value, sd = number
    return Entry(
        level, "vertebra", code, _unit(code), value, None if value is None else sd, normal_interval(value, sd),
        origin if value is not None else "not_measured", origin == "assumed", reason, (level,), derivation, since,
    )  # fmt: skip


def _unit(code: str) -> str:
    if code in DEFINITIONS:
        return DEFINITIONS[code].unit
    return "mm" if code.startswith(_MILLIMETRES) else "deg"


def _axes(
    prefix: str, values: Iterable[float | None] | None, deviations: Iterable[float | None] | None
) -> dict[str, Number]:
    names = (f"{prefix}-{axis}" for axis in "xyz")
    return dict(zip(names, zip(values or [None] * 3, deviations or [None] * 3, strict=True), strict=True))


def _states(spine: StageSpine) -> Iterator[Entry]:
    for state in spine.vertebrae:
        origin, reason = state.origin.value, state.reason
        if state.position_mm is None:
            yield _component(state.vertebra, "pose", _UNKNOWN, origin, reason)
            continue
        for code, number in _axes("position", state.position_mm, state.position_sd_mm).items():
            yield _component(state.vertebra, code, number, origin, state.position_reason)
        yield from _measures_of(state)


def _measures_of(state: VertebraState) -> Iterator[Entry]:
    """Yield the measures of a vertebra; results of earlier versions have neither their intervals nor their status."""
    tilt, sagittal, axial, lateral = _MEASURES
    values = {
        tilt: (state.coronal_tilt_deg, state.coronal_tilt_sd_deg),
        sagittal: (state.sagittal_tilt_deg, state.sagittal_tilt_sd_deg),
        axial: (state.axial_rotation_deg, state.axial_rotation_sd_deg),
        lateral: (state.lateral_displacement_mm, state.lateral_displacement_sd_mm),
    }
    intervals = {
        tilt: state.coronal_tilt_interval_deg,
        sagittal: state.sagittal_tilt_interval_deg,
        axial: state.axial_rotation_interval_deg,
        lateral: state.lateral_displacement_interval_mm,
    }
    for code, number in values.items():
        entry = _component(state.vertebra, code, number, state.origin.value, state.reason)
        if entry.value is not None:
            entry = replace(entry, interval=_ends(intervals[code]) or entry.interval)
            if state.status is MeasureStatus.BRACKETED:
                entry = replace(entry, status=state.status.value, reason=state.bracketed_reason)
        else:
            entry = replace(entry, reason=state.reason or state.not_measured_reason)
        yield entry


def _remaining(spine: StageSpine) -> Iterator[Entry]:
    origins = {state.vertebra: state.origin.value for state in spine.vertebrae}
    for left in spine.remaining or ():
        tilts = (left.coronal_deg, left.sagittal_deg, left.axial_deg)
        numbers = dict(zip(_TILTS, zip(tilts, left.sd_deg, strict=True), strict=True))
        planned = _axes("translation", left.translation_mm, left.translation_sd_mm)
        numbers.update({code: number for code, number in planned.items() if number[0] is not None})
        for code, number in numbers.items():
            origin = origins.get(left.vertebra, "not_measured")
            yield _component(left.vertebra, code, number, origin, None, derivation="remaining")


def _changes(spine: StageSpine) -> Iterator[Entry]:
    changes = [change for change in (spine.since_baseline, spine.since_previous) if change is not None]
    if len(changes) == 2 and changes[0].since == changes[1].since:
        changes.pop()
    curves = {curve.name for curve in spine.curves}
    for change in changes:
        since = change.since.name
        for measure in change.measures:
            yield _measure(measure, "change", since)
        for part in change.attribution:
            kind = "curve" if part.subject in curves else "vertebra"
            yield from _shares(part, kind, since)
        for moved in change.vertebrae:
            numbers = _of_change(moved) if moved.rotation is not None else {"motion": _UNKNOWN}
            for code, number in numbers.items():
                entry = _component(
                    moved.vertebra,
                    code,
                    number,
                    moved.origin.value,
                    moved.reason,
                    derivation="change",
                    since=since,
                )
                yield replace(entry, interval=angle_interval(moved)) if code == "rotation-angle" else entry


def _of_change(moved: VertebraChange) -> dict[str, Number]:
    return {
        **_axes("translation", moved.translation_mm, moved.translation_sd_mm),
        **_axes("rotation", moved.rotation_vector_deg, moved.rotation_sd_deg),
        "rotation-angle": (moved.angle_deg, moved.angle_sd_deg),
        "derotation": (moved.derotation_deg, moved.derotation_sd_deg),
        "coronal-tilt": (moved.coronal_deg, moved.coronal_sd_deg),
        "sagittal-tilt": (moved.sagittal_deg, moved.sagittal_sd_deg),
        "distraction": (moved.distraction_mm, moved.distraction_sd_mm),
    }


def _shares(part: Attribution, kind: str, since: str) -> Iterator[Entry]:
    """Yield the parts of a change, but no remainder that is exactly zero.

    Nothing says that a part without a status was measured.
    """
    status = (part.status or MeasureStatus.BRACKETED).value
    shares = [("by-rotation", part.rotation), ("by-distraction", part.distraction)]
    if part.remainder != 0:
        shares.append(("remainder", part.remainder_share))
    for derivation, share in shares:
        known = share.value is not None
        yield Entry(
            part.subject, kind, part.quantity, part.unit, share.value, share.sd if known else None,
            _ends(share.interval) if known else None, status if known else "not_measured", bool(part.assumed),
            part.reason, tuple(part.levels), derivation, since,
        )  # fmt: skip
