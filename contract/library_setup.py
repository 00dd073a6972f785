"""From the documents of a surgery to the library's setup of its spine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contract.radiograph import common_points, landmarked_vertebra
from contract.spine_setup import (
    InitialGeneric,
    InitialPoses,
    InitialRadiographs,
    NewRebaseline,
    SpineSetup,
    VertebraPose,
    patient_axes,
    patient_axes_covariance,
)
from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.levels import anatomical_sequence, level_numbers
from spinewatch.spine import configuration
from spinewatch.spine.axes_checks import patient_axes_flags
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.generic_spine import generic_spine
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.initial_reversals import initial_reversal_flags
from spinewatch.spine.initial_tilts import initial_tilt_flags
from spinewatch.spine.level_shift import level_shift_flags
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.spine.patient_axes import require_axes_of_triads
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.spine.radiographs import initial_from_radiographs
from spinewatch.triads.pose import Pose


@dataclass(frozen=True)
class SurgeryLevels:
    """The vertebrae of a surgery.

    Attributes
    ----------
    reference_vertebra
        Vertebra of the surgery's reference triad; a setup may name another.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    """

    reference_vertebra: str
    extra_levels: Sequence[str] = ()


def library_setup(
    document: SpineSetup,
    rebaselines: Sequence[NewRebaseline],
    surgery: SurgeryLevels,
    baseline: str,
    triads: Mapping[str, Pose],
    radiographs: Mapping[str, RadiographView],
) -> tuple[configuration.SpineSetup, tuple[Flag, ...]]:
    """Return the library's setup and doubts about its initial configuration.

    ``triads`` are the labelled poses at the baseline stage, in its object space. Raises ``SpinewatchError`` when the
    patient axes contradict the triads, the initial configuration cannot be placed, or its tilts are those of no spine.
    """
    axes = patient_axes(document.patient_axes)
    require_axes_of_triads(axes, triads, surgery.extra_levels)
    initial, flags = _initial(document, axes, surgery.extra_levels, triads, radiographs)
    setup = configuration.SpineSetup(
        patient_axes=axes,
        reference=document.reference_vertebra or surgery.reference_vertebra,
        baseline=baseline,
        initial=initial,
        rebaselines=tuple(
            configuration.Rebaseline(item.vertebra, item.before, item.after) for item in rebaselines
        ),
        extra_levels=tuple(surgery.extra_levels),
        axes_covariance_deg2=patient_axes_covariance(document.patient_axes),
    )
    return setup, (*patient_axes_flags(setup, triads), *_fit_flags(document, setup, triads), *flags)


def _fit_flags(
    document: SpineSetup, setup: configuration.SpineSetup, triads: Mapping[str, Pose]
) -> tuple[Flag, ...]:
    """Return why the triads do not fit the initial vertebrae: reversed poses, or else their levels, or else unknown."""
    if setup.initial.kind is InitialKind.GENERIC:  # the triads made that one
        return ()
    of_poses = initial_reversal_flags(setup, triads) if setup.initial.kind is InitialKind.POSES else ()
    if any(flag.code == "initial-poses-reversed" for flag in of_poses):
        return of_poses
    placed = isinstance(document.initial, InitialPoses) and document.initial.frame == "patient"
    of_levels = level_shift_flags(setup.initial, triads, setup.extra_levels, placed_by_triads=placed)
    return of_levels or of_poses


def marked_poses(document: SpineSetup, poses: Mapping[str, Pose]) -> dict[str, Pose]:
    """Return the poses of the triads that a setup counts on."""
    levels = document.levels
    return {name: pose for name, pose in poses.items() if levels is None or name in levels}


def _initial(
    document: SpineSetup,
    axes: Float,
    extra_levels: Sequence[str],
    triads: Mapping[str, Pose],
    radiographs: Mapping[str, RadiographView],
) -> tuple[InitialSpine, tuple[Flag, ...]]:
    initial = document.initial
    if isinstance(initial, InitialPoses):
        spine = _from_poses(initial, axes, extra_levels, triads)
        stated = {pose.vertebra: (pose.position_sd_mm, pose.rotation_sd_deg) for pose in initial.poses}
        return spine, initial_tilt_flags(
            spine.levels,
            level_numbers(spine.levels, extra_levels),
            spine.position_mm @ axes,
            axes.T @ spine.rotation,
            stated_sd=np.array([stated[name] for name in spine.levels]),
        )
    if isinstance(initial, InitialRadiographs):
        covariance = patient_axes_covariance(document.patient_axes)
        return _from_radiographs(initial, axes, covariance, extra_levels, triads, radiographs)
    return _generic(initial, axes, extra_levels, triads), ()


def _from_poses(
    initial: InitialPoses, axes: Float, extra_levels: Sequence[str], triads: Mapping[str, Pose]
) -> InitialSpine:
    sequence = anatomical_sequence(extra_levels)
    poses = sorted(initial.poses, key=lambda pose: sequence.index(pose.vertebra))
    return initial_from_poses(
        [pose.vertebra for pose in poses],
        np.array([pose.position_mm for pose in poses]),
        np.stack([_rotation(pose, initial.frame, axes) for pose in poses]),
        np.array([pose.position_sd_mm for pose in poses]),
        np.array([pose.rotation_sd_deg for pose in poses]),
        frame=initial.frame,
        patient_axes=axes,
        triads=triads,
        extra_levels=extra_levels,
        turned_with_axes=[initial.frame == "patient" or pose.rotation is None for pose in poses],
    )


def _rotation(pose: VertebraPose, frame: str, axes: Float) -> Float:
    """Return the rotation from vertebra to the axes of the frame; angles are always in patient axes."""
    if pose.rotation is not None:
        return np.array(pose.rotation)
    coronal, sagittal, axial = pose.angles_deg or (0.0, 0.0, 0.0)
    rotation = rotation_from_tilts(coronal, sagittal, axial)
    return axes @ rotation if frame == "object" else rotation


def _from_radiographs(
    initial: InitialRadiographs,
    axes: Float,
    axes_covariance_deg2: Float,
    extra_levels: Sequence[str],
    triads: Mapping[str, Pose],
    radiographs: Mapping[str, RadiographView],
) -> tuple[InitialSpine, tuple[Flag, ...]]:
    common, left_out = common_points(initial, triads)
    spine, fit = initial_from_radiographs(
        radiographs[initial.pa],
        radiographs[initial.lateral],
        [landmarked_vertebra(vertebra) for vertebra in initial.vertebrae],
        common,
        initial.landmark_sd_px,
        extra_levels,
        patient_axes=axes,
        axes_covariance_deg2=axes_covariance_deg2,
    )
    return spine, (*fit.flags, *_left_out_flags(left_out))


def _left_out_flags(names: Sequence[str]) -> tuple[Flag, ...]:
    if not names:
        return ()
    detail = (
        f"the landmarks {', '.join(names)} name triads without a pose at the baseline stage and are left out of the"
        " fit; take the baseline again, or give their points in object space"
    )
    return (Flag("radiograph-landmark-left-out", detail),)


def _generic(
    initial: InitialGeneric, axes: Float, extra_levels: Sequence[str], triads: Mapping[str, Pose]
) -> InitialSpine:
    return generic_spine(triads, axes, initial.cranial, initial.caudal, extra_levels)
