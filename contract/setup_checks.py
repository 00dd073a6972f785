"""Checks of a spine's setup that need no image: levels, axes, stages and radiographs; each error names its field."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contract.spine_setup import (
    InitialPoses,
    InitialRadiographs,
    NewRebaseline,
    SpineSetup,
    patient_axes,
    planned_vertebrae,
)
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.levels import anatomical_sequence
from spinewatch.spine.initial import InitialParameters
from spinewatch.spine.target import TargetError, check_target

_RIGID_TOLERANCE = 1e-3
"""Largest deviation of R R^T from the identity: a matrix that was typed with four decimals passes."""

Path = tuple[str | int, ...]


class SpineSetupError(ParameterError):
    """A field of a setup cannot be used.

    Parameters
    ----------
    path
        The field, from the top of the document.
    problem
        What is wrong and what to do.
    code
        Name of the problem.
    """

    code = "invalid-spine-setup"

    def __init__(self, path: Path, problem: str, code: str) -> None:
        super().__init__(f"{'.'.join(str(part) for part in path)}: {problem}")
        self.path = path
        self.code = code


@dataclass(frozen=True)
class SurgeryContext:
    """What a setup must agree with.

    Attributes
    ----------
    vertebrae
        Vertebrae with a marker.
    reference_vertebra
        Vertebra of the reference triad, unless the setup names another.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    stages
        Names of the stages that there are, in the order in which they were first submitted.
    radiographs
        Views, ``pa`` or ``lateral``, of the surgery's radiographs by identifier.
    """

    vertebrae: Sequence[str]
    reference_vertebra: str
    extra_levels: Sequence[str]
    stages: Sequence[str]
    radiographs: Mapping[str, str]


def check_setup(setup: SpineSetup, context: SurgeryContext) -> None:
    """Check that a setup can be used for a surgery.

    Parameters
    ----------
    setup
        The setup.
    context
        The surgery.

    Raises
    ------
    SpineSetupError
        A field cannot be used; the first one that is found.
    """
    try:
        patient_axes(setup.patient_axes)
    except SpinewatchError as error:
        raise SpineSetupError(("patient_axes",), str(error), error.code) from error
    known = anatomical_sequence(context.extra_levels)
    marked = _check_marked(setup, context, known)
    if setup.baseline is not None and setup.baseline not in context.stages:
        raise _unknown_stage(("baseline",), setup.baseline)
    initial = setup.initial
    if isinstance(initial, InitialPoses):
        path: Path = ("initial", "poses")
        levels = [pose.vertebra for pose in initial.poses]
        _check_levels(path, levels, known)
        _check_complete(path, levels, marked)
        _check_ranges(initial)
        _check_rotations(initial)
    elif isinstance(initial, InitialRadiographs):
        path = ("initial", "vertebrae")
        levels = [landmarks.vertebra for landmarks in initial.vertebrae]
        _check_levels(path, levels, known)
        _check_complete(path, levels, marked)
        _check_radiographs(initial, marked, context.radiographs)
    else:
        _check_levels(("initial",), [initial.cranial, initial.caudal], known, ("cranial", "caudal"))
        first, last = known.index(initial.cranial), known.index(initial.caudal)
        if first > last:
            raise SpineSetupError(
                ("initial", "cranial"),
                f"{initial.cranial} lies below {initial.caudal}; exchange them",
                "invalid-levels",
            )
        levels = list(known[first : last + 1])
        _check_complete(("initial",), levels, marked)
    _check_target(setup, levels, known)


def check_rebaseline(new: NewRebaseline, setup: SpineSetup, context: SurgeryContext) -> None:
    """Check that a marker can have been clamped again.

    Parameters
    ----------
    new
        The vertebra and the stages.
    setup
        The setup.
    context
        The surgery.

    Raises
    ------
    SpineSetupError
        A field cannot be used.
    """
    marked = setup.levels or context.vertebrae
    reference = setup.reference_vertebra or context.reference_vertebra
    if new.vertebra not in marked:
        raise SpineSetupError(
            ("vertebra",), f"{new.vertebra} has no marker; name one of {', '.join(marked)}", "not-marked"
        )
    if new.vertebra == reference:
        raise SpineSetupError(
            ("vertebra",),
            f"{new.vertebra} is the reference: after its marker was clamped again, stages have no common frame; choose"
            " another reference_vertebra whose marker stayed in place",
            "reference-clamped-again",
        )
    for field in ("before", "after"):
        if getattr(new, field) not in context.stages:
            raise _unknown_stage((field,), getattr(new, field))
    if context.stages.index(new.before) >= context.stages.index(new.after):
        raise SpineSetupError(
            ("after",),
            f"stage {new.after} was not submitted after stage {new.before}; give the last stage with the former place"
            " and the first one with the new place",
            "stages-out-of-order",
        )


def _check_marked(setup: SpineSetup, context: SurgeryContext, known: Sequence[str]) -> Sequence[str]:
    """Return the vertebrae with a marker."""
    marked: Sequence[str] = context.vertebrae
    if setup.levels is not None:
        _check_levels(("levels",), setup.levels, known)
        for index, level in enumerate(setup.levels):
            if level not in context.vertebrae:
                raise SpineSetupError(
                    ("levels", index),
                    f"{level} has no marker in this surgery; name one of {', '.join(context.vertebrae)}",
                    "not-marked",
                )
        marked = setup.levels
    reference = setup.reference_vertebra or context.reference_vertebra
    if reference not in marked:
        raise SpineSetupError(
            ("reference_vertebra",),
            f"the reference {reference} is not among the vertebrae with a marker; name one of {', '.join(marked)}",
            "not-marked",
        )
    return marked


def _check_levels(
    path: Path, levels: Sequence[str], known: Sequence[str], fields: Sequence[str] = ()
) -> None:
    places: Sequence[str | int] = fields or range(len(levels))
    for place, level in zip(places, levels, strict=True):
        if level not in known:
            raise SpineSetupError(
                (*path, place),
                "this spine has no vertebra of that name; correct it, or declare it among the surgery's extra_levels",
                "unknown-level",
            )
    for index, level in _repeated(levels):
        if not fields:
            raise SpineSetupError((*path, index), f"{level} is given twice; give it once", "duplicate-level")


def _repeated(levels: Sequence[str]) -> Iterator[tuple[int, str]]:
    seen: set[str] = set()
    for index, level in enumerate(levels):
        if level in seen:
            yield index, level
        seen.add(level)


def _check_complete(path: Path, levels: Collection[str], marked: Sequence[str]) -> None:
    missing = [level for level in marked if level not in levels]
    if missing:
        raise SpineSetupError(
            path,
            f"{', '.join(missing)} {'has a marker' if len(missing) == 1 else 'have markers'} but no pose here; add"
            " every vertebra with a marker, or leave it out of levels",
            "missing-level",
        )


def _check_ranges(initial: InitialPoses) -> None:
    limits = InitialParameters()
    for index, pose in enumerate(initial.poses):
        path = ("initial", "poses", index)
        if np.abs(pose.position_mm).max() > limits.max_coordinate_mm:
            raise SpineSetupError(
                (*path, "position_mm"),
                f"the centroid of {pose.vertebra} is beyond {limits.max_coordinate_mm / 1000:g} m; give it in mm",
                "position-out-of-range",
            )
        coronal, sagittal, axial = np.abs(pose.angles_deg or [0.0] * 3)
        if not (max(coronal, sagittal) < limits.max_tilt_deg and axial <= limits.max_axial_deg):
            raise SpineSetupError(
                (*path, "angles_deg"),
                f"the angles of {pose.vertebra} are those of no spine; tilts are below {limits.max_tilt_deg:g} degrees,"
                f" and the axial rotation is up to {limits.max_axial_deg:g}",
                "angles-out-of-range",
            )


def _check_rotations(initial: InitialPoses) -> None:
    for index, pose in enumerate(initial.poses):
        if pose.rotation is None:
            continue
        R = np.array(pose.rotation)
        path = ("initial", "poses", index, "rotation")
        if np.abs(R @ R.T - np.eye(3)).max() > _RIGID_TOLERANCE:
            raise SpineSetupError(
                path,
                f"the axes of {pose.vertebra} are not perpendicular unit vectors; give a rotation matrix",
                "axes-not-rigid",
            )
        if np.linalg.det(R) < 0:
            raise SpineSetupError(
                path,
                f"the axes of {pose.vertebra} are left-handed: a reflection; columns are anterior, left and cephalad",
                "axes-reflected",
            )


def _check_radiographs(
    initial: InitialRadiographs, marked: Sequence[str], radiographs: Mapping[str, str]
) -> None:
    for field in ("pa", "lateral"):
        identifier = getattr(initial, field)
        if identifier not in radiographs:
            raise SpineSetupError(
                ("initial", field),
                "this surgery has no radiograph of that identifier; upload it to this surgery first",
                "unknown-radiograph",
            )
        if radiographs[identifier] != field:
            raise SpineSetupError(
                ("initial", field),
                f"this radiograph is a {radiographs[identifier]} view; give the {field} one",
                "wrong-view",
            )
    names: set[str] = set()
    for index, landmark in enumerate(initial.common):
        path = ("initial", "common", index)
        if landmark.name in names:
            raise SpineSetupError(
                (*path, "name"), "this name is used twice; give each point its own", "duplicate-name"
            )
        names.add(landmark.name)
        if landmark.triad is not None and landmark.triad not in marked:
            raise SpineSetupError(
                (*path, "triad"),
                f"{landmark.triad} has no marker; name one of {', '.join(marked)}",
                "not-marked",
            )


def _check_target(setup: SpineSetup, levels: Sequence[str], known: Sequence[str]) -> None:
    planned = planned_vertebrae(setup)
    if planned is None:
        return
    _check_levels(("target",), [item.vertebra for item in planned], known)
    if not planned:
        raise SpineSetupError(
            ("target",),
            "the target names no vertebra; give the planned pose of one, or null",
            "invalid-target",
        )
    for index, item in enumerate(planned):
        if item.vertebra not in levels:
            raise SpineSetupError(
                ("target", index, "vertebra"),
                f"{item.vertebra} is not in the initial configuration ({levels[0]} to {levels[-1]}): the target belongs"
                " to another patient, or the vertebra must be added to the initial configuration",
                "target-of-other-levels",
            )
        try:
            check_target([item], levels)
        except TargetError as error:
            raise SpineSetupError(("target", index), str(error), error.code) from error


def _unknown_stage(path: Path, name: str) -> SpineSetupError:
    return SpineSetupError(
        path,
        f"this surgery has no stage {name}; submit the stage first, or correct the name",
        "unknown-stage",
    )
