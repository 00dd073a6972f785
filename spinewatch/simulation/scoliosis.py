"""Simulated scoliotic spines with known poses, their correction, and the markers that they carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.spines import random_rotation
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.orientation import rotation_from_tilts, tilts_of
from spinewatch.triads.pose import Pose

LEVELS = tuple([f"T{i}" for i in range(1, 13)] + [f"L{i}" for i in range(1, 6)])
"""Levels of every simulated spine, from cranial to caudal."""

BODY_HEIGHT_MM = np.array(
    [14.1, 15.6, 15.7, 16.2, 16.2, 17.4, 18.2, 18.7, 19.3, 20.2, 21.3, 22.7, 23.8, 24.3, 23.8, 24.1, 22.9]
)
"""Posterior heights of the bodies, mm (Panjabi et al., Spine 16 (1991) 888 and 17 (1992) 299)."""

DISC_HEIGHT_MM = np.array([4.5, 4, 4, 4, 4, 4.5, 4.5, 5, 5.5, 6, 6.5, 7.5, 8.5, 9.5, 10.5, 11.0])
"""Heights of the discs below each level but the last, mm: round values of adults."""

_T1, _L1, _L5 = 0, LEVELS.index("L1"), len(LEVELS) - 1


class CurveKind(StrEnum):
    """Which curves a simulated spine has."""

    THORACIC = "thoracic"
    LUMBAR = "lumbar"
    DOUBLE = "double"


@dataclass(frozen=True)
class ScoliosisParameters:
    """Ranges of simulated spines; every pair is the least and the greatest value.

    Attributes
    ----------
    cobb_deg
        Cobb angle of each curve, degrees.
    greatest_step_deg
        Greatest mean change of the coronal tilt from level to level, degrees, within a curve and beyond its ends; short
        curves have small Cobb angles.
    thoracic_upper, thoracic_lower, lumbar_upper, lumbar_lower
        End vertebrae of the curves, names of levels. The extremes of tilt lie anywhere between them. In a double
        curve the thoracic one ends where the lumbar one begins.
    compensation
        How far the tilts of T1 and of L5 come back from that of the nearest end vertebra, as a share of the Cobb
        angle of its curve; 0.5 makes them level beside a symmetric curve.
    kyphosis_deg, lordosis_deg
        Difference of the sagittal tilts of T1 and L1, and of L5 and L1, degrees.
    axial_per_cobb
        Axial rotation of the apex as a share of the Cobb angle.
    height_sd
        Standard deviation of the size of a person, as a share.
    irregularity_sd_deg
        Standard deviation of the deviation of each vertebra from the smooth curves, per angle, degrees.
    """

    cobb_deg: tuple[float, float] = (20.0, 90.0)
    greatest_step_deg: float = 12.0
    thoracic_upper: tuple[str, str] = ("T4", "T6")
    thoracic_lower: tuple[str, str] = ("T10", "T12")
    lumbar_upper: tuple[str, str] = ("T10", "T12")
    lumbar_lower: tuple[str, str] = ("L3", "L4")
    compensation: tuple[float, float] = (0.3, 0.5)
    kyphosis_deg: tuple[float, float] = (15.0, 45.0)
    lordosis_deg: tuple[float, float] = (30.0, 55.0)
    axial_per_cobb: tuple[float, float] = (0.2, 0.4)
    height_sd: float = 0.06
    irregularity_sd_deg: float = 0.0


@dataclass(frozen=True, eq=False)
class SimulatedSpine:
    """A spine that is known exactly.

    Attributes
    ----------
    rotation
        Rotations from vertebra to patient axes, shape (17, 3, 3).
    body_mm
        Heights of the bodies, shape (17,), mm.
    disc_mm
        Heights of the discs below each level but the last, shape (16,), mm.
    ends
        Places of the greatest and least coronal tilt in ``LEVELS``, from cranial to caudal, not rounded.
    """

    rotation: Float
    body_mm: Float
    disc_mm: Float
    ends: tuple[float, ...]

    @property
    def poses(self) -> SpinePoses:
        """Poses of the bodies, patient axes; the origin is the centroid of L5."""
        z = self.rotation[:, :, 2]
        middle = z[:-1] + z[1:]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        half = self.body_mm[:, None] / 2 * z
        steps = half[:-1] + self.disc_mm[:, None] * middle + half[1:]
        above = np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))])
        return SpinePoses(above, self.rotation)


@dataclass(frozen=True)
class Manoeuvre:
    """What a surgeon does to a spine between two stages.

    Attributes
    ----------
    straightening
        Share of the tangent of every coronal tilt that is removed.
    rod_rotation_deg
        Rotation of the plane of the curve about the patient's long axis, degrees; it turns coronal tilt into sagittal
        tilt. Greatest in the middle of the instrumented part and none ``margin_levels`` beyond its ends.
    twist_share
        Share of the rod rotation by which the vertebrae themselves turn about their own axes; the rest is sliding
        between rod and anchors.
    margin_levels
        How many levels beyond the instrumented part the rod rotation reaches.
    derotation
        Share of every axial rotation that is removed.
    distraction_mm
        Lengthening of the discs of the instrumented part together, mm.
    irregularity_sd_deg
        Standard deviation of a rotation of each vertebra that follows no pattern, per axis, degrees.
    """

    straightening: float = 0.0
    rod_rotation_deg: float = 0.0
    twist_share: float = 0.2
    margin_levels: float = 3.0
    derotation: float = 0.0
    distraction_mm: float = 0.0
    irregularity_sd_deg: float = 0.0


@dataclass(frozen=True)
class MountParameters:
    """How markers are clamped to vertebrae.

    Attributes
    ----------
    posterior_mm
        Distance of P behind the centroid of the body, mm.
    sd_mm
        Standard deviation of its place, per axis, mm.
    tilt_sd_deg
        Standard deviation of the tilt of the normal against the posterior direction, per axis, degrees. The azimuth of
        the marker in its plane is uniformly distributed.
    """

    posterior_mm: float = 45.0
    sd_mm: float = 5.0
    tilt_sd_deg: float = 8.0


def random_scoliosis(
    rng: np.random.Generator, kind: CurveKind, parameters: ScoliosisParameters | None = None
) -> SimulatedSpine:
    """Return a random scoliotic spine.

    Coronal and sagittal tilts are smooth along the spine, with zero slope at their extremes; the axial rotation turns
    the bodies towards the convex side and is greatest at the apex.

    Parameters
    ----------
    rng
        Source of random numbers.
    kind
        Which curves it has.
    parameters
        Ranges; the default ones if None.

    Returns
    -------
    SimulatedSpine
        The spine.

    Examples
    --------
    >>> spine = random_scoliosis(np.random.default_rng(0), CurveKind.DOUBLE)
    >>> len(spine.ends), spine.poses.position_mm.shape
    (3, (17, 3))
    """
    p = parameters or ScoliosisParameters()
    spans = {
        CurveKind.THORACIC: (p.thoracic_upper, p.thoracic_lower),
        CurveKind.LUMBAR: (p.lumbar_upper, p.lumbar_lower),
        CurveKind.DOUBLE: (p.thoracic_upper, p.thoracic_lower, p.lumbar_lower),
    }[kind]
    ends = tuple(float(rng.uniform(*map(LEVELS.index, span))) for span in spans)
    greatest = np.minimum(p.cobb_deg[1], p.greatest_step_deg * np.diff(ends))
    cobb = rng.uniform(p.cobb_deg[0], greatest)
    convex = 1.0 if rng.random() < 0.5 else -1.0
    signed = cobb * convex * np.array([1.0, -1.0])[: len(cobb)]
    knots = np.array([_T1, *ends, _L5])
    coronal = _half_cosines(knots, _coronal_extremes(rng, knots, signed, p))
    kyphosis, lordosis = rng.uniform(*p.kyphosis_deg), rng.uniform(*p.lordosis_deg)
    level = -0.35 * kyphosis - 2
    sagittal = _half_cosines(np.array([_T1, _L1, _L5]), np.array([level + kyphosis, level, level + lordosis]))
    axial = np.zeros(len(LEVELS))
    for (upper, lower), angle in zip(pairwise(ends), signed, strict=True):
        share = np.clip((np.arange(len(LEVELS)) - upper) / (lower - upper), 0, 1)
        axial -= rng.uniform(*p.axial_per_cobb) * angle * np.sin(np.pi * share) ** 2
    tilts = [a + p.irregularity_sd_deg * rng.standard_normal(len(LEVELS)) for a in (coronal, sagittal, axial)]
    size = 1 + p.height_sd * rng.standard_normal()
    return SimulatedSpine(rotation_from_tilts(*tilts), size * BODY_HEIGHT_MM, size * DISC_HEIGHT_MM, ends)


def corrected(
    spine: SimulatedSpine,
    manoeuvre: Manoeuvre,
    rng: np.random.Generator | None = None,
) -> SimulatedSpine:
    """Return a spine after a manoeuvre on the levels between its outermost end vertebrae.

    Parameters
    ----------
    spine
        The spine before.
    manoeuvre
        What is done.
    rng
        Source of the irregular rotations; none are made if None.

    Returns
    -------
    SimulatedSpine
        The spine after; its bodies have the same heights.

    Examples
    --------
    >>> spine = random_scoliosis(np.random.default_rng(0), CurveKind.LUMBAR)
    >>> longer = corrected(spine, Manoeuvre(distraction_mm=10.0))
    >>> round(float(longer.disc_mm.sum() - spine.disc_mm.sum()), 9)
    10.0
    """
    _, _, axial = tilts_of(spine.rotation)
    z = spine.rotation[:, :, 2] / spine.rotation[:, 2:, 2]
    turn = np.radians(manoeuvre.rod_rotation_deg) * _bell(spine.ends, manoeuvre.margin_levels)
    lateral = (1 - manoeuvre.straightening) * z[:, 1]
    coronal = -np.degrees(np.arctan(np.sin(turn) * z[:, 0] + np.cos(turn) * lateral))
    sagittal = np.degrees(np.arctan(np.cos(turn) * z[:, 0] - np.sin(turn) * lateral))
    axial = (1 - manoeuvre.derotation) * axial + manoeuvre.twist_share * np.degrees(turn)
    R = rotation_from_tilts(coronal, sagittal, axial)
    if rng is not None:
        irregular = manoeuvre.irregularity_sd_deg * rng.standard_normal((len(LEVELS), 3))
        R = rotation_from_vector(np.radians(irregular)) @ R
    share = np.clip((np.arange(len(LEVELS)) - spine.ends[0]) / (spine.ends[-1] - spine.ends[0]), 0, 1)
    within = (np.diff(share) > 0).astype(np.float64)
    return SimulatedSpine(
        R,
        spine.body_mm,
        spine.disc_mm + manoeuvre.distraction_mm * within / within.sum(),
        spine.ends,
    )


def mirrored(spine: SimulatedSpine) -> SimulatedSpine:
    """Return the mirror image of a spine in the sagittal plane.

    Parameters
    ----------
    spine
        A spine.

    Returns
    -------
    SimulatedSpine
        Left and right are exchanged: coronal tilts and axial rotations have the opposite sign.
    """
    flip = np.diag([1.0, -1.0, 1.0])
    return SimulatedSpine(flip @ spine.rotation @ flip, spine.body_mm, spine.disc_mm, spine.ends)


def prone_axes(axis: Literal["x", "y"] = "x", *, head_first: bool = True) -> Float:
    """Return the patient axes of a prone patient in object space.

    Parameters
    ----------
    axis
        Object axis along the spine.
    head_first
        Whether it points to the head.

    Returns
    -------
    Float
        Rotation from patient to object axes, shape (3, 3); posterior is up, object +Z.

    Examples
    --------
    >>> prone_axes("x") @ [1.0, 0.0, 0.0]
    array([ 0.,  0., -1.])
    """
    anterior = np.array([0.0, 0.0, -1.0])
    cephalad = np.zeros(3)
    cephalad["xy".index(axis)] = 1.0 if head_first else -1.0
    return np.column_stack([anterior, np.cross(cephalad, anterior), cephalad])


def random_mounts(
    rng: np.random.Generator, levels: Sequence[str], parameters: MountParameters | None = None
) -> dict[str, Pose]:
    """Return how markers are clamped to vertebrae: their poses in the axes of the vertebrae.

    Parameters
    ----------
    rng
        Source of random numbers.
    levels
        Vertebrae that carry one.
    parameters
        Ranges; the default ones if None.

    Returns
    -------
    dict
        Pose of the triad in the axes of its vertebra, by level, with zero covariance.
    """
    p = parameters or MountParameters()
    facing = np.column_stack([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return {
        level: Pose(
            np.array([-p.posterior_mm, 0.0, 0.0]) + p.sd_mm * rng.standard_normal(3),
            facing @ random_rotation(rng, p.tilt_sd_deg),
            np.zeros((6, 6)),
        )
        for level in levels
    }


def placed(poses: SpinePoses, patient_axes: Float, centre_mm: Float) -> SpinePoses:
    """Return the poses of vertebrae in object space.

    Parameters
    ----------
    poses
        Poses, patient axes.
    patient_axes
        Rotation from patient to object axes, shape (3, 3).
    centre_mm
        Where the mean of the centroids lies, shape (3,), object space, mm.

    Returns
    -------
    SpinePoses
        Poses, object space.
    """
    arms = poses.position_mm - poses.position_mm.mean(axis=0)
    return SpinePoses(centre_mm + arms @ patient_axes.T, patient_axes @ poses.rotation)


def moved_cart(poses: SpinePoses, rotation: Float, shift_mm: Float, about_mm: Float) -> SpinePoses:
    """Return poses as seen by a cart that moved: object space is fixed to its cameras.

    Parameters
    ----------
    poses
        Poses in the object space before.
    rotation
        Rotation from the object axes before to those after, shape (3, 3).
    shift_mm
        Displacement of what the cart sees, shape (3,), mm.
    about_mm
        Point that the rotation leaves in place, shape (3,), mm.

    Returns
    -------
    SpinePoses
        Poses in the object space after.
    """
    arms = poses.position_mm - about_mm
    return SpinePoses(about_mm + shift_mm + arms @ rotation.T, rotation @ poses.rotation)


def triads_on(poses: SpinePoses, mounts: Mapping[str, Pose]) -> dict[str, Pose]:
    """Return the true poses of the markers on a spine.

    Parameters
    ----------
    poses
        Poses of the bodies of all ``LEVELS``.
    mounts
        Poses of triads in the axes of their vertebrae.

    Returns
    -------
    dict
        Poses of the triads in the space of ``poses``, by level, with zero covariance.
    """
    return {
        level: Pose(
            poses.position_mm[i] + poses.rotation[i] @ mount.position_mm,
            poses.rotation[i] @ mount.rotation,
            np.zeros((6, 6)),
        )
        for level, mount in mounts.items()
        for i in (LEVELS.index(level),)
    }


def _coronal_extremes(
    rng: np.random.Generator, knots: Float, signed_cobb_deg: Float, parameters: ScoliosisParameters
) -> Float:
    """Return the coronal tilts of T1, of the end vertebrae and of L5, degrees, from Cobb angles with sign."""
    ends = np.concatenate([[0.0], np.cumsum(signed_cobb_deg)])
    ends -= (ends.max() + ends.min()) / 2
    back = rng.uniform(*parameters.compensation, 2) * (ends[[1, -2]] - ends[[0, -1]])
    greatest = parameters.greatest_step_deg * np.array([knots[1] - knots[0], knots[-1] - knots[-2]])
    top, bottom = ends[[0, -1]] + np.clip(back, -greatest, greatest)
    return np.array([top, *ends, bottom])


def _bell(ends: tuple[float, ...], margin: float) -> Float:
    """Return a squared sine over the levels, 1 in the middle between the outer ends and 0 a margin beyond them."""
    first, last = ends[0] - margin, ends[-1] + margin
    return np.asarray(np.sin(np.pi * np.clip((np.arange(len(LEVELS)) - first) / (last - first), 0, 1)) ** 2)


def _half_cosines(knots: Float, values: Float) -> Float:
    """Return a function at every level that passes from each knot (k,) to the next along half a cosine."""
    x = np.arange(len(LEVELS), dtype=np.float64)
    k = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    share = (x - knots[k]) / (knots[k + 1] - knots[k])
    return np.asarray(values[k] + (values[k + 1] - values[k]) * (1 - np.cos(np.pi * share)) / 2)
