"""A generic spine fitted to the triads, where nothing is known of the initial configuration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.errors import ParameterError
from spinewatch.geometry.covariance import covariance_factor
from spinewatch.levels import LevelError, anatomical_sequence, canonical_name, level_numbers
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.spine.sequence import sequence_with
from spinewatch.triads.pose import Pose


class NoTriadsError(ParameterError):
    """No triad that a generic spine could be fitted to."""

    code = "no-triads"


@dataclass(frozen=True)
class GenericSpineParameters:
    """The generic spine, and how far that of a patient may be from it.

    Attributes
    ----------
    body_height_mm
        Heights of the bodies by vertebra, mm: Panjabi et al., Spine 16 (1991) 888 and 17 (1992) 299, posterior height,
        for T1 to L5; round values for the others.
    disc_height_mm
        Heights of the discs below them, mm: round values of adults.
    kyphosis_deg
        Difference of the sagittal tilts of T1 and T12, degrees; Bernhardt and Bridwell, Spine 14 (1989) 717, have 36
        for T3 to T12.
    lordosis_deg
        Difference of those of L5 and T12, degrees; there too.
    lean_deg
        Sagittal tilt of T12, degrees.
    triad_offset_mm
        P of a triad from the centroid of its vertebra, along the vertebra's own axes (anterior, left, cephalad), mm.
    triad_offset_sd_mm
        Its standard deviation per axis, mm; the curve is smoothed accordingly.
    roughness_mm
        Standard deviation of the change from level to level of a vertebra's displacement per level, mm. A curve of 60
        degrees over six levels of 27 mm has 5 mm.
    slope_sd_mm
        Standard deviation of the mean displacement per level, mm; 5 mm incline the spine by some 10 degrees.
    tilt_sd_deg
        Standard deviation of the tilt of a vertebra against the tangent of the curve, per axis, degrees.
    axial_sd_deg
        Standard deviation of the axial rotation, which the curve says nothing of, degrees. It also swings the triads
        about the bodies.
    axial_correlation_levels
        Distance over which axial rotations are alike: their correlation falls to exp(-1/2), levels.
    """

    body_height_mm: Mapping[str, float]
    disc_height_mm: Mapping[str, float]
    kyphosis_deg: float = 40.0
    lordosis_deg: float = 44.0
    lean_deg: float = -20.0
    triad_offset_mm: tuple[float, float, float] = (-45.0, 0.0, 0.0)
    triad_offset_sd_mm: float = 8.0
    roughness_mm: float = 4.0
    slope_sd_mm: float = 6.0
    tilt_sd_deg: float = 6.0
    axial_sd_deg: float = 15.0
    axial_correlation_levels: float = 3.0


_BODIES = (
    {"C1": 12.0, "C2": 20.0}
    | {f"C{i}": 13.0 for i in range(3, 8)}
    | dict(
        zip(
            [f"T{i}" for i in range(1, 14)],
            (14.1, 15.6, 15.7, 16.2, 16.2, 17.4, 18.2, 18.7, 19.3, 20.2, 21.3, 22.7, 23.2),
            strict=True,
        )
    )
    | dict(zip([f"L{i}" for i in range(1, 7)], (23.8, 24.3, 23.8, 24.1, 22.9, 22.9), strict=True))
    | {"S1": 30.0, "S2": 25.0, "S3": 21.0, "S4": 18.0, "S5": 16.0}
)
_DISCS = (
    {"C1": 0.0}
    | {f"C{i}": 5.0 for i in range(2, 8)}
    | dict(
        zip(
            [f"T{i}" for i in range(1, 14)],
            (4.5, 4.0, 4.0, 4.0, 4.0, 4.5, 4.5, 5.0, 5.5, 6.0, 6.5, 7.5, 8.0),
            strict=True,
        )
    )
    | dict(zip([f"L{i}" for i in range(1, 7)], (8.5, 9.5, 10.5, 11.0, 10.5, 10.5), strict=True))
    | {f"S{i}": 0.0 for i in range(1, 6)}
)
GENERIC_SPINE = GenericSpineParameters(_BODIES, _DISCS)
"""The generic spine of an adult."""

_ITERATIONS = 3


def generic_spine(
    triads: Mapping[str, Pose],
    patient_axes: Float,
    cranial: str = "T1",
    caudal: str = "L5",
    extra_levels: Sequence[str] = (),
    parameters: GenericSpineParameters | None = None,
) -> InitialSpine:
    """Return a generic spine that is fitted to triads; everything derived from it is assumed.

    Parameters
    ----------
    triads
        Poses of the triads at the baseline stage by vertebra, object space; at least one.
    patient_axes
        Rotation from patient to object axes, shape (3, 3).
    cranial, caudal
        The first and the last vertebra; triads beyond them extend the spine.
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        The generic spine; `GENERIC_SPINE` if None.

    Returns
    -------
    InitialSpine
        Poses in object space with errors that leave room for what is not known: the offsets of the triads, tilts
        against the curve, axial rotation. Its kind is ``generic``.

    Raises
    ------
    NoTriadsError
        If there is no triad.
    LevelError
        If a vertebra is unknown, or ``cranial`` is not above ``caudal``.

    References
    ----------
    The displacement of the bodies from a spine of mean heights, kyphosis and lordosis is a random function whose second
    derivative along the spine is white noise, which the triads show with the errors of their offsets (Rasmussen and
    Williams, Gaussian Processes for Machine Learning (2006), sections 2.2 and 6.3). Each z is along the curve, and y as
    near to the patient's left as it can be.

    Examples
    --------
    >>> import numpy as np
    >>> triad = Pose(np.array([0.0, 0.0, 0.0]), np.eye(3), np.zeros((6, 6)))
    >>> spine = generic_spine({"T12": triad}, np.eye(3))
    >>> spine.kind.value, len(spine.levels), bool(30 < spine.position_mm[11, 0] < 60)
    ('generic', 17, True)
    """
    p = parameters or GENERIC_SPINE
    if not triads:
        raise NoTriadsError(
            "a generic spine needs a triad to be fitted to; choose a baseline stage with triads, or give an initial"
            " configuration"
        )
    levels = _levels(cranial, caudal, tuple(triads), extra_levels)
    marked = [levels.index(name) for name in triads]
    P = np.array([triad.position_mm for triad in triads.values()]) @ patient_axes
    template, R = _template(levels, p)
    offset = np.array(p.triad_offset_mm)
    gain, factor = _displacements(len(levels), np.array(marked), p)
    position = template
    for _ in range(_ITERATIONS):
        shown = P - R[marked] @ offset - template[marked]
        position = template + shown.mean(axis=0) + gain @ (shown - shown.mean(axis=0))
        R = _along(position)
    errors = _errors(position, factor, p)
    turned = np.concatenate([patient_axes @ errors[:, :3], patient_axes @ errors[:, 3:]], axis=1)
    return InitialSpine(InitialKind.GENERIC, levels, position @ patient_axes.T, patient_axes @ R, turned)


def _levels(
    cranial: str, caudal: str, marked: tuple[str, ...], extra_levels: Sequence[str]
) -> tuple[str, ...]:
    """Return the vertebrae from the first to the last, with those that carry a triad."""
    ends = canonical_name(cranial), canonical_name(caudal)
    first, last = level_numbers(ends, extra_levels)
    if first >= last:
        raise LevelError(f"{ends[0]} is not above {ends[1]}; name the most cranial vertebra first")
    numbers = [first, last, *level_numbers(marked, extra_levels)]
    return anatomical_sequence(extra_levels)[min(numbers) : max(numbers) + 1]


def _template(levels: tuple[str, ...], p: GenericSpineParameters) -> tuple[Float, Float]:
    """Return positions (n, 3) of the generic spine from its last centroid, mm, and rotations (n, 3, 3)."""
    order = sequence_with(levels)
    number = np.array([order.index(name) for name in levels], dtype=float)
    top, turn, bottom = (order.index(name) for name in ("T1", "T12", "L5"))
    # Tilts are extreme at T1, T12 and L5 and constant beyond.
    thorax = (1 + np.cos(np.pi * np.clip((number - top) / (turn - top), 0, 1))) / 2
    loin = (1 - np.cos(np.pi * np.clip((number - turn) / (bottom - turn), 0, 1))) / 2
    tilt = p.lean_deg + p.kyphosis_deg * thorax + p.lordosis_deg * loin
    R = rotation_from_tilts(0.0, tilt, 0.0)
    z = R[:, :, 2]
    half = np.array([p.body_height_mm[name] for name in levels])[:, None] / 2 * z
    disc = np.array([p.disc_height_mm[name] for name in levels])[:, None] * z
    steps = half[:-1] + disc[:-1] + half[1:]
    return np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))]), R


def _displacements(n: int, marked: Int, p: GenericSpineParameters) -> tuple[Float, Float]:
    """Return the gain (n, m) from displacements shown by triads to those of all bodies, and a factor of its errors."""
    t = np.arange(n, dtype=float)
    low, high = np.minimum.outer(t, t), np.maximum.outer(t, t)
    centred = t - t[marked].mean()
    # Where the whole spine is, only the triads say.
    anywhere = (100 * p.triad_offset_sd_mm) ** 2
    K = (
        anywhere
        + p.slope_sd_mm**2 * np.outer(centred, centred)
        + p.roughness_mm**2 * low**2 * (3 * high - low) / 6
    )
    noise = p.triad_offset_sd_mm**2 * np.eye(len(marked))
    gain = np.linalg.solve(K[np.ix_(marked, marked)] + noise, K[marked]).T
    left = np.eye(n)
    left[:, marked] -= gain
    covariance = left @ K @ left.T + gain @ noise @ gain.T
    return gain, covariance_factor(covariance)


def _along(position: Float) -> Float:
    """Return rotations whose z is along a curve and whose y is as near to the patient's left as it can be."""
    z = -np.gradient(position, axis=0)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    y = np.array([0.0, 1.0, 0.0]) - z[:, 1:2] * z
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([np.cross(y, z), y, z], axis=2)


def _errors(position: Float, factor: Float, p: GenericSpineParameters) -> Float:
    """Return the errors of the bodies (n, 6, 6n), patient axes: curve, axial rotation, tilts against the curve."""
    n = len(position)
    spacing = np.linalg.norm(np.gradient(position, axis=0), axis=1)[:, None]
    t = np.arange(n) / p.axial_correlation_levels
    axial = covariance_factor(p.axial_sd_deg**2 * np.exp(-0.5 * np.subtract.outer(t, t) ** 2))
    errors = np.zeros((n, 6, 6 * n))
    for axis in range(3):
        errors[:, axis, axis * n : (axis + 1) * n] = factor
    errors[:, 5, 3 * n : 4 * n] = axial
    # A body that is turned to the left has its triad on its right.
    errors[:, 1, 3 * n : 4 * n] = -p.triad_offset_mm[0] * np.radians(axial)
    # The errors of the curve tilt the bodies.
    errors[:, 4] = np.degrees(-np.gradient(errors[:, 0], axis=0) / spacing)
    errors[:, 3] = np.degrees(np.gradient(errors[:, 1], axis=0) / spacing)
    for row, columns in ((3, slice(4 * n, 5 * n)), (4, slice(5 * n, 6 * n))):
        errors[:, row, columns] = p.tilt_sd_deg * np.eye(n)
    return errors
