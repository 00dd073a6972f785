"""What image points and sensors must be: pixels of the image of a camera, and shots that differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from spinewatch.calibration.errors import PixelSizeError, PointsError
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.bundle import rms


def check_sensor(sensor: Sensor, parameters: CalibrationLimits) -> None:
    """Check that the pixels of a sensor have a size that pixels can have.

    Parameters
    ----------
    sensor
        The sensor.
    parameters
        Limits.

    Raises
    ------
    PixelSizeError
        If they do not; the message gives the unit.
    """
    low, high = parameters.pixel_mm
    width, height = sensor.pixel_size_mm
    if not (low <= width <= high and low <= height <= high):
        unit = next(
            (
                f": in {name}?"
                for name, factor in (("micrometres", 0.001), ("metres", 1000.0))
                if low <= factor * width <= high
            ),
            "",
        )
        raise PixelSizeError(
            f"the pixel size is {width:g} x {height:g} mm{unit}; give it in mm, between {low:g} and {high:g}"
        )


def check_image_points(
    images: Iterable[tuple[str, ImagePoints]], sensor: Sensor, parameters: CalibrationLimits
) -> None:
    """Check that the image points of one camera are pixels of its image.

    Parameters
    ----------
    images
        Name and image points of each image of the camera.
    sensor
        The sensor.
    parameters
        Limits.

    Raises
    ------
    PointsError
        If the points lie within one or two pixels, or one lies outside the image.
    """
    w, h = sensor.image_size_px
    for where, image in images:
        if len(image) > 1 and np.ptp(image.pixels, axis=0).max() < parameters.min_extent_px:
            u, v = np.ptp(image.pixels, axis=0)
            raise PointsError(
                f"{where}: all points lie within {u:.2g} x {v:.2g} px, hardly more than one pixel: normalized"
                " coordinates? Give u_px and v_px in pixels"
            )
        border = 0.5 + parameters.border_px
        outside = np.any((image.pixels < -border) | (image.pixels > np.array([w, h]) - 1 + border), axis=1)
        if outside.any():
            i = int(np.argmax(outside))
            swapped = image.pixels[:, ::-1]
            fits = np.all((swapped >= -border) & (swapped <= np.array([w, h]) - 1 + border))
            cause = ", or exchange u_px and v_px" if fits else ""
            u, v = image.pixels[i]
            raise PointsError(
                f"{where}: point {image.ids[i]} at ({u:.1f}, {v:.1f}) px lies outside the image of {w} x {h} px"
                f" ({outside.sum()} of {len(image)} points do); give the size of the image that was measured{cause}"
            )


def repeated_shots(shots: Sequence[Shot], parameters: CalibrationLimits) -> dict[int, tuple[int, float]]:
    """Return the shots that show the board where an earlier shot shows it.

    Parameters
    ----------
    shots
        The shots.
    parameters
        Limits.

    Returns
    -------
    dict of int to tuple
        Index of the earlier shot, and the RMS difference of the image points, px, by index of the repeated shot.
    """
    repeated: dict[int, tuple[int, float]] = {}
    for later, shot in enumerate(shots):
        for earlier in range(later):
            difference = _difference_px(shots[earlier], shot)
            if earlier not in repeated and difference <= parameters.repeated_px:
                repeated[later] = (earlier, difference)
                break
    return repeated


def _difference_px(a: Shot, b: Shot) -> float:
    """Return the RMS difference of the common image points of both sides; infinite if a side has too few."""
    differences = []
    for one, other in zip(a.images, b.images, strict=True):
        pixels = dict(zip(other.ids, other.pixels, strict=True))
        common = [uv - pixels[id_] for id_, uv in zip(one.ids, one.pixels, strict=True) if id_ in pixels]
        if 2 * len(common) <= min(len(one), len(other)):
            return float("inf")
        differences.append(np.array(common))
    return rms(np.concatenate(differences))
