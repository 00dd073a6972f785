"""Stereo rigs for simulation: those of the thesis, and others whose axes converge."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.angles import degrees_from_dms

CART_IMAGE_PX = (568, 416)
CART_PIXEL_MM = (0.01, 0.00845)
MEASURING_VOLUME_CENTRE_MM = (434.0, 390.0, 90.0)


def table_3_3_rig() -> Rig:
    """Return the rig of Table 3.3, trial C: baseline 422 mm, vergence 32 degrees.

    Returns
    -------
    Rig
        The cameras with the cart's sensor. K2, P1 and P2 are set to zero; the printed values are negligible.

    References
    ----------
    Thesis Table 3.3.

    Examples
    --------
    >>> rig = table_3_3_rig()
    >>> round(rig.baseline_mm), round(rig.vergence_deg)
    (422, 32)
    """

    def camera(position: tuple[float, float, float], dms: tuple[float, float, float], *lens: float) -> Camera:
        omega, phi, kappa = map(degrees_from_dms, dms)
        focal, x0, y0, k1 = lens
        return Camera(
            position,
            (omega, phi, kappa),
            focal,
            (x0, y0),
            (k1, 0.0),
            (0.0, 0.0),
            CART_IMAGE_PX,
            CART_PIXEL_MM,
        )

    return Rig(
        "table-3-3",
        left=camera(
            (223.9545, 442.5372, 743.9232), (-50609.0, -165732.2, 12336.1), 7.776, 0.061, 0.078, 0.0029
        ),
        right=camera(
            (645.7806, 442.3287, 734.5083), (-42648.9, 151302.0, -15556.3), 7.556, 0.018, 0.090, 0.0033
        ),
    )


def converging_rig(
    baseline_mm: float,
    vergence_deg: float,
    *,
    target_mm: tuple[float, float, float] = MEASURING_VOLUME_CENTRE_MM,
    image_size_px: tuple[int, int] = CART_IMAGE_PX,
    radial: tuple[float, float] = (0.003, 0.0),
    decentering: tuple[float, float] = (0.0, 0.0),
) -> Rig:
    """Return two cameras above a target, side by side along X, whose axes intersect there.

    Parameters
    ----------
    baseline_mm
        Distance between the cameras, mm.
    vergence_deg
        Angle between the optical axes, degrees.
    target_mm
        Point of convergence, object space, mm.
    image_size_px
        (W, H), px; the sensor has the width of the cart's.
    radial
        K1 per mm^2, K2 per mm^4.
    decentering
        P1, P2 per mm.

    Returns
    -------
    Rig
        The cameras.
    """
    height = baseline_mm / 2 / np.tan(np.radians(vergence_deg / 2))
    scale = CART_IMAGE_PX[0] / image_size_px[0]

    def camera(side: int) -> Camera:
        x, y, z = target_mm
        centre = (x + side * baseline_mm / 2, y, z + float(height))
        return Camera(
            position_mm=centre,
            rotation_deg=angles_towards(np.array(centre), np.array(target_mm)),
            focal_length_mm=7.7,
            principal_point_mm=(0.02 * side, 0.05),
            radial=radial,
            decentering=decentering,
            image_size_px=image_size_px,
            pixel_size_mm=(CART_PIXEL_MM[0] * scale, CART_PIXEL_MM[1] * scale),
        )

    return Rig(f"converging-{baseline_mm:g}-{vergence_deg:g}", left=camera(-1), right=camera(1))


def small_rig() -> Rig:
    """Return the small configuration of section 5.4.

    Returns
    -------
    Rig
        Baseline 320 mm, vergence 24 degrees.
    """
    return converging_rig(320.0, 24.0)


def large_rig() -> Rig:
    """Return the large configuration of section 5.4.

    Returns
    -------
    Rig
        Baseline 420 mm, vergence 32 degrees.
    """
    return converging_rig(420.0, 32.0)


def random_rig(rng: np.random.Generator) -> Rig:
    """Return a random rig: baseline 300 to 500 mm, range 500 to 900 mm, plausible lens distortion.

    Parameters
    ----------
    rng
        Source of random numbers.

    Returns
    -------
    Rig
        The cameras.
    """
    baseline, distance = rng.uniform(300, 500), rng.uniform(500, 900)
    return converging_rig(
        baseline,
        float(np.degrees(2 * np.arctan(baseline / 2 / distance))),
        radial=(rng.uniform(-0.004, 0.004), rng.uniform(-5e-5, 5e-5)),
        decentering=(rng.uniform(-2e-4, 2e-4), rng.uniform(-2e-4, 2e-4)),
    )


def angles_towards(centre_mm: Float, target_mm: Float) -> tuple[float, float, float]:
    """Return the angles of a camera that points at a target, with object X to the right in the image.

    Parameters
    ----------
    centre_mm
        Perspective centre, shape (3,), object space, mm.
    target_mm
        Target, shape (3,), object space, mm.

    Returns
    -------
    tuple of float
        (omega, phi, kappa), degrees.
    """
    z = (centre_mm - target_mm) / np.linalg.norm(centre_mm - target_mm)
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    angles = np.degrees([np.arctan2(-z[1], z[2]), np.arcsin(z[0]), np.arctan2(-y[0], x[0])])
    return float(angles[0]), float(angles[1]), float(angles[2])


def perturbed_rig(rig: Rig, rng: np.random.Generator, rotation_sd_deg: float, shift_sd_mm: float) -> Rig:
    """Return a rig with simulated calibration errors: its right camera is rotated and displaced a little.

    Parameters
    ----------
    rig
        The true rig.
    rng
        Source of random numbers.
    rotation_sd_deg
        Standard deviation of the rotation, per axis, degrees.
    shift_sd_mm
        Standard deviation of the displacement, per axis, mm.

    Returns
    -------
    Rig
        The perturbed rig; the rig itself when both standard deviations are zero.
    """
    if not (rotation_sd_deg or shift_sd_mm):
        return rig
    rotation = np.radians(rotation_sd_deg) * rng.standard_normal(3)
    right = rig.right.moved(rotation, shift_sd_mm * rng.standard_normal(3))
    return Rig(f"{rig.name} (perturbed)", rig.left, right)


def convergence_point(rig: Rig) -> Float:
    """Return the point nearest to both optical axes.

    Parameters
    ----------
    rig
        A rig whose axes are not parallel.

    Returns
    -------
    Float
        The midpoint of the axes' common perpendicular, shape (3,), object space, mm.

    Raises
    ------
    ParameterError
        If the axes are parallel.
    """
    depths = rig.axes_approach_mm
    if depths is None:
        raise ParameterError("the optical axes are parallel: give a rig whose cameras converge")
    ends = [
        camera.centre - depth * camera.M[2]
        for camera, depth in zip((rig.left, rig.right), depths, strict=True)
    ]
    return np.asarray(np.mean(ends, axis=0))
