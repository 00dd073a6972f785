"""Comparison of the lens of one camera in two calibrations: where its pixels look, whatever the camera's orientation.

A refocused lens has another focal length, and a calibration from one shot of a board determines it poorly. What no
other focal length explains, distortion and the aspect of pixels, differs little between two sound calibrations of a
lens, and much when one has the wrong sign of K1, another distortion model or another pixel size.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.flags import Flag
from spinewatch.rig_plausibility import SIDES, pixel_grid


@dataclass(frozen=True)
class LensComparisonParameters:
    """Limit of `lens_flags`.

    Attributes
    ----------
    max_shape_px
        Largest difference of two calibrations of one lens that no other focal length explains, px, RMS over the image.
        Of 542 pairs of simulated calibrations with noise of 0.05 and 0.1 px none had more than 0.38, of 270 with 0.2
        px some had 0.8; the other sign of a K1 of 0.003 per mm^2 makes 3.4, another aspect of pixels by 1% 1.0.
    """

    max_shape_px: float = 0.7


@dataclass(frozen=True)
class LensDifference:
    """Difference of a lens in two calibrations.

    Attributes
    ----------
    focal_share
        Relative difference of the focal lengths that explains most of it.
    shape_px
        What remains of the directions of pixels: difference of distortion and aspect of pixels, px, RMS over the image.
    """

    focal_share: float
    shape_px: float


def compare_lenses(camera: Camera, other: Camera) -> LensDifference:
    """Return how a lens differs from that of another calibration.

    Parameters
    ----------
    camera, other
        The camera in two calibrations, with images of one size.

    Returns
    -------
    LensDifference
        The difference. Position and orientation do not matter, and a shift of the principal point counts only as far
        as no rotation explains it.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from spinewatch.simulation.rigs import large_rig
    >>> camera = large_rig().left
    >>> turned = replace(camera, rotation_deg=(0.0, 5.0, 90.0), focal_length_mm=1.002 * camera.focal_length_mm)
    >>> difference = compare_lenses(turned, camera)
    >>> round(difference.focal_share, 4), round(difference.shape_px, 3)
    (0.002, 0.0)
    >>> round(compare_lenses(replace(camera, radial=(-camera.radial[0], 0.0)), camera).shape_px, 1)
    3.5
    """
    pixels = pixel_grid(camera.image_size_px)
    of_first, of_other = (_tangents(each, pixels) for each in (camera, other))
    x, y = of_other.T
    one = np.ones_like(x)
    # Columns: a small rotation about each axis, and another focal length.
    columns = [[x * y, one + y * y], [-one - x * x, -x * y], [y, -x], [-x, -y]]
    A = np.array(columns).transpose(1, 2, 0).reshape(-1, 4)
    b = (of_first - of_other).T.ravel()
    motion = np.linalg.lstsq(A, b, rcond=None)[0]
    px = other.focal_length_mm / float(np.mean(other.pixel_size_mm))
    shape = px * float(np.sqrt(2 * np.mean((b - A @ motion) ** 2)))
    return LensDifference(float(motion[3]), shape)


def lens_flags(
    rig: Rig, earlier: Sequence[tuple[str, Rig]], parameters: LensComparisonParameters | None = None
) -> Iterator[Flag]:
    """Yield a flag when a rig has another lens than those of earlier stages.

    Parameters
    ----------
    rig
        The rig of a stage.
    earlier
        Names of earlier stages that were measured with another calibration, and their rigs, in their order.
    parameters
        Limit; the default one if None.

    Yields
    ------
    Flag
        ``lens-differs``, once, for the latest such stage. Cameras of another image size are not compared.
    """
    limit = (parameters or LensComparisonParameters()).max_shape_px
    for name, other in reversed(earlier):
        sides = [
            (side, getattr(rig, side), getattr(other, side))
            for side in SIDES
            if getattr(rig, side).image_size_px == getattr(other, side).image_size_px
        ]
        found = [(side, compare_lenses(camera, camera_then)) for side, camera, camera_then in sides]
        parts = [
            f"the {side} camera by {difference.shape_px:.1f} px (RMS over the image, at most {limit:g})"
            for side, difference in found
            if difference.shape_px > limit
        ]
        if parts:
            yield Flag(
                "lens-differs",
                f"the calibration of this stage differs from that of stage {name} in distortion or aspect of pixels:"
                f" {' and '.join(parts)}; one of them has the wrong sign of K1, another distortion model or pixel size,"
                " and the difference appears as motion; calibrate both alike",
            )
            return


def _tangents(camera: Camera, pixels: Float) -> Float:
    """Return the tangents (n, 2) of the angles of pixels (n, 2) from the optical axis, right and up."""
    return np.asarray(camera.undistort(camera.plate(pixels)) / camera.focal_length_mm)
