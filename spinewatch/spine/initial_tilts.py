"""The tilts of initial poses compared with the line of their centroids: radians, wrong signs and wrong sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.spine.initial_tilt_scale import directions_deg, tilt_scale_doubt
from spinewatch.spine.orientation import tilts_of

_LEVEL_DEG = 1e-6
"""Greatest tilt of rounding: vertebrae that are all level are simulated, not given in radians."""

_PLANES = ("coronal", "sagittal")


class InitialTiltsError(ParameterError):
    """Tilts of an initial configuration that are those of no spine along the line of its centroids."""

    code = "initial-tilts"


@dataclass(frozen=True)
class InitialTiltParameters:
    """How the tilts of initial poses are compared with the line of their centroids.

    Attributes
    ----------
    max_radian_deg
        Greatest tilt that may be an angle in radians, read as degrees: a right angle.
    max_bend_deg
        Greatest difference between the directions of the line in one plane with tilts that are all below
        ``max_radian_deg``. End plates differ from the line by 6 degrees (sd), each in its own way, so that a spine with
        such tilts everywhere is as straight.
    max_gap_levels
        Greatest number of levels between vertebrae whose chord is compared with the mean of their tilts; a curve may
        return between vertebrae farther apart.
    min_span_levels
        Least number of levels between the first and the last vertebra of a spine that cannot be level throughout.
    max_rms_deg
        Greatest root mean square of the differences between mean tilts and chords in one plane, about their mean, which
        is that of the axes of patient and poses, degrees; beyond, tilts are doubtful that fit another way.
    min_rms_ratio
        How many times smaller it must be with the opposite sign, or with the tilts of the other plane.
    """

    max_radian_deg: float = np.pi / 2
    max_bend_deg: float = 10.0
    max_gap_levels: int = 4
    min_span_levels: int = 4
    max_rms_deg: float = 10.0
    min_rms_ratio: float = 2.0


def initial_tilt_flags(
    names: Sequence[str],
    numbers: Sequence[int] | Int,
    position_mm: Float,
    rotation: Float,
    parameters: InitialTiltParameters | None = None,
    stated_sd: Float | None = None,
) -> tuple[Flag, ...]:
    """Return flags of tilts that do not follow the line of the centroids.

    The direction of the line between neighbours, given at most ``max_gap_levels`` apart, is compared with the mean of
    their tilts, which it is exactly in an arc of a circle.

    Parameters
    ----------
    names
        The n vertebrae, from cranial to caudal.
    numbers
        Their places in the anatomical sequence, increasing, shape (n,).
    position_mm
        Centroids of the bodies, patient axes, shape (n, 3), mm.
    rotation
        Rotations from vertebra to patient axes, shape (n, 3, 3).
    parameters
        Limits; the default ones if None.
    stated_sd
        Stated standard deviations of positions (mm) and rotations (degrees), shape (n, 2); None if there are none.

    Returns
    -------
    tuple of Flag
        ``initial-tilts-doubtful``: every tilt could be in radians and the line is straight, or the tilts of a plane
        follow the line only with the opposite sign, or in the other plane, or are of another size.

    Raises
    ------
    InitialTiltsError
        If every tilt could be in radians and the line bends.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.spine.orientation import rotation_from_tilts
    >>> tilts, z = np.array([20.0, 8.0, -8.0, -20.0]), np.array([90.0, 60.0, 30.0, 0.0])
    >>> y = np.array([0.0, 7.5, 7.5, 0.0])
    >>> position = np.stack([np.zeros(4), y, z], axis=1)
    >>> bodies = lambda tilts: np.stack([rotation_from_tilts(t, 0.0, 0.0) for t in tilts])
    >>> names, numbers = ("T8", "T9", "T10", "T11"), (14, 15, 16, 17)
    >>> [len(initial_tilt_flags(names, numbers, position, bodies(s * tilts))) for s in (1.0, -1.0)]
    [0, 1]
    """
    p = parameters or InitialTiltParameters()
    number = np.asarray(numbers)
    tilts = np.stack(tilts_of(rotation)[:2], axis=1)
    gap = np.flatnonzero(np.diff(number) <= p.max_gap_levels)
    chords = directions_deg(position_mm[gap] - position_mm[gap + 1])
    small = bool((np.abs(tilts) <= p.max_radian_deg).all())
    if small and len(gap) > 1:
        bend = np.ptp(chords, axis=0)
        plane = int(np.argmax(bend))
        if bend[plane] > p.max_bend_deg:
            raise InitialTiltsError(
                f"every tilt is below {p.max_radian_deg:.2g} degrees, and the line of the centroids from {names[0]} to"
                f" {names[-1]} bends by {bend[plane]:.0f} degrees in the {_PLANES[plane]} plane; give angles in"
                " degrees, not in radians, and no zeros for angles that are not known"
            )
    if small and (np.abs(tilts) > _LEVEL_DEG).any() and number[-1] - number[0] >= p.min_span_levels:
        detail = (
            f"every tilt from {names[0]} to {names[-1]} is below {p.max_radian_deg:.2g} degrees, as those of no spine"
            " are; give angles in degrees, not in radians"
        )
        return (Flag("initial-tilts-doubtful", detail),)
    if len(gap) < 2:
        return ()
    mean = (tilts[gap] + tilts[gap + 1]) / 2
    error = _rms(mean - chords)
    others = np.stack([_rms(-mean - chords), _rms(mean[:, ::-1] - chords)])
    flags = []
    for k, name in enumerate(_PLANES):
        if error[k] > p.max_rms_deg and others[:, k].min() < error[k] / p.min_rms_ratio:
            doubt: str | None = (
                f"differ from the line of the centroids by {error[k]:.0f} degrees (RMS), those with the opposite sign"
                f" by {others[0, k]:.0f} and those of the other plane by {others[1, k]:.0f}; check their signs and"
                " order, and the axes of the positions"
            )
        else:
            doubt = tilt_scale_doubt(number, position_mm, tilts[:, k], k, stated_sd)
        if doubt is not None:
            flags.append(Flag("initial-tilts-doubtful", f"{name} tilts {doubt}"))
    return tuple(flags)


def _rms(differences_deg: Float) -> Float:
    """Return the RMS of differences (m, 2) about their mean, per plane (2,), degrees."""
    return np.asarray(differences_deg.std(axis=0))
