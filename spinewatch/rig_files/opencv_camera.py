"""Conversion between the collinearity camera and OpenCV's (K, R, t, dist).

OpenCV's polynomial distorts ideal points, that of collinearity (eq. 3.4) corrects measured points. Neither has a
closed-form inverse, so one polynomial is fitted to the other over the image, and the maximum error is returned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.errors import RigError
from spinewatch.geometry.rotations import angles_from_rotation
from spinewatch.rig_plausibility import lens_problem, pixel_grid

_GRID = 25
_MAX_REPROJECTION_PX = 1e-3
_N_COEFFICIENTS = (4, 5, 8, 12, 14)
_FLIP = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class OpenCvCamera:
    """A camera in OpenCV's model, with x right, y down, z forward.

    Attributes
    ----------
    K
        Camera matrix, shape (3, 3), px.
    R
        Rotation from object to camera axes, shape (3, 3).
    t
        Translation of ``R X + t``, shape (3,), mm.
    dist
        Distortion coefficients (k1, k2, p1, p2, k3).
    image_size_px
        (W, H), px.
    fit_error_px
        Maximum distance over the image between the two models' images of the same ray, px.
    """

    K: Float
    R: Float
    t: Float
    dist: Float
    image_size_px: tuple[int, int]
    fit_error_px: float


def to_opencv(camera: Camera) -> OpenCvCamera:
    """Return the OpenCV camera nearest to a collinearity camera.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    OpenCvCamera
        The camera; its distortion is a least-squares fit over the image.

    References
    ----------
    OpenCV documentation, Camera Calibration and 3D Reconstruction.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> to_opencv(large_rig().left).fit_error_px < 0.01
    True
    """
    px, py = camera.pixel_size_mm
    f = camera.focal_length_mm
    cx, cy = camera.pixels(camera.principal_point_mm)
    K = np.array([[f / px, 0, cx], [0, f / py, cy], [0, 0, 1]])
    pixels = pixel_grid(camera.image_size_px, _GRID)
    ideal = camera.undistort(camera.plate(pixels)) / f * (1, -1)
    r2 = (ideal**2).sum(axis=1)
    x, y = ideal.T
    columns = [
        ideal * r2[:, None],
        ideal * (r2**2)[:, None],
        np.stack([2 * x * y, r2 + 2 * y * y], axis=1),
        np.stack([r2 + 2 * x * x, 2 * x * y], axis=1),
        ideal * (r2**3)[:, None],
    ]
    scale = np.array([K[0, 0], K[1, 1]])
    A = np.stack([(c * scale).ravel() for c in columns], axis=1)
    norm = np.linalg.norm(A, axis=0)
    distortion = pixels - (ideal * scale + K[:2, 2])
    dist = np.linalg.lstsq(A / norm, distortion.ravel(), rcond=None)[0] / norm
    errors = np.linalg.norm((A @ dist).reshape(-1, 2) - distortion, axis=1)
    R = _FLIP @ camera.M
    return OpenCvCamera(K, R, -R @ camera.centre, dist, camera.image_size_px, float(errors.max()))


def from_opencv(
    K: ArrayLike,
    R: ArrayLike,
    t: ArrayLike,
    dist: ArrayLike,
    image_size_px: tuple[int, int],
    pixel_width_mm: float = 0.01,
) -> tuple[Camera, float]:
    """Return the collinearity camera nearest to an OpenCV camera.

    Parameters
    ----------
    K
        Camera matrix, shape (3, 3), px.
    R
        Rotation from object to camera axes, shape (3, 3).
    t
        Translation of ``R X + t``, shape (3,), mm.
    dist
        Distortion coefficients: 4, 5, 8, 12 or 14 numbers.
    image_size_px
        (W, H), px.
    pixel_width_mm
        Width of a pixel on the plate, mm, which is not part of OpenCV's model; it is the scale of f, x0 and y0.

    Returns
    -------
    camera : Camera
        The camera.
    fit_error_px : float
        Maximum error of the fitted distortion over the image, px.

    Raises
    ------
    RigError
        If K, R or dist, the field of the error, is not that of a camera with this image size.
    """
    matrix, R = np.asarray(K, dtype=np.float64), np.asarray(R, dtype=np.float64)
    _check_matrix(matrix)
    if R.shape != (3, 3) or np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
        raise RigError("R", "must be a rotation matrix")
    f = matrix[0, 0] * pixel_width_mm
    pixel = (pixel_width_mm, f / matrix[1, 1])
    centre = -R.T @ np.asarray(t, dtype=np.float64).ravel()
    sensor = Camera(
        (float(centre[0]), float(centre[1]), float(centre[2])),
        angles_from_rotation(_FLIP @ R),
        float(f),
        (0.0, 0.0),
        (0.0, 0.0),
        (0.0, 0.0),
        image_size_px,
        (float(pixel[0]), float(pixel[1])),
    )
    x0, y0 = sensor.plate(matrix[:2, 2])
    principal = (float(x0), float(y0))
    problem = lens_problem(replace(sensor, principal_point_mm=principal))
    if problem is not None:
        raise RigError("K", problem[1])
    pixels = pixel_grid(image_size_px, _GRID)
    return _fitted(sensor, principal, pixels, _ideal_rays(matrix, dist, pixels) * (f, -f))


def _check_matrix(K: Float) -> None:
    """Raise RigError for a camera matrix that is not one."""
    if K.shape != (3, 3) or not np.all(np.isfinite(K)):
        raise RigError("K", "must be a finite 3 x 3 matrix")
    if not K[:2, 2].any() and K[2, :2].any():
        raise RigError(
            "K", "is transposed: its last row must be 0 0 1, and its last column the principal point"
        )
    if min(K[0, 0], K[1, 1]) <= 0:
        raise RigError("K", "must have positive focal lengths")
    if not np.array_equal(K[2], (0, 0, 1)):
        raise RigError("K", "must have the last row 0 0 1; write f/px, f/py and the principal point in px")
    if max(abs(K[0, 1]), abs(K[1, 0])) > 1e-6 * K[0, 0]:
        raise RigError(
            "K", "has a skew, which the collinearity camera does not model; calibrate without skew"
        )


def _ideal_rays(K: Float, dist: ArrayLike, pixels: Float) -> Float:
    """Return the undistorted image points (n, 2) of pixels on a grid (n, 2), at a focal length of 1."""
    coefficients = np.asarray(dist, dtype=np.float64).ravel()
    if coefficients.size not in _N_COEFFICIENTS or not np.all(np.isfinite(coefficients)):
        raise RigError("dist", "must be 4, 5, 8, 12 or 14 finite numbers")
    end = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    found = cv2.undistortPointsIter(pixels[:, None], K, coefficients, np.eye(3), np.eye(3), end)
    rays = np.asarray(found, dtype=np.float64)[:, 0]
    points = np.column_stack([rays, np.ones(len(rays))])
    again = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, coefficients)[0][:, 0]
    cells = rays.reshape(_GRID, _GRID, 2)
    right, down = cells[:-1, 1:] - cells[:-1, :-1], cells[1:, :-1] - cells[:-1, :-1]
    ordered = right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0] > 0
    if not (np.abs(again - pixels).max() < _MAX_REPROJECTION_PX and ordered.all()):
        raise RigError(
            "dist",
            "makes the distortion fold within the image, where a pixel has no ray or two; calibrate with points up to"
            " the image border and fewer coefficients",
        )
    return rays


def _fitted(
    sensor: Camera, principal: tuple[float, float], pixels: Float, ideal: Float
) -> tuple[Camera, float]:
    """Return the camera whose distortion maps pixels (n, 2) to ideal offsets (n, 2), and its maximum error, px."""
    d = sensor.plate(pixels) - principal
    unit = float(np.abs(d).max())
    powers = np.array([unit**-2, unit**-4, unit**-1, unit**-1])

    def camera(x: Float) -> Camera:
        K1, K2, P1, P2 = (float(v) for v in x * powers)
        return Camera(
            sensor.position_mm,
            sensor.rotation_deg,
            sensor.focal_length_mm,
            principal,
            (K1, K2),
            (P1, P2),
            sensor.image_size_px,
            sensor.pixel_size_mm,
        )

    def residuals(x: Float) -> Float:
        return np.asarray(
            (camera(x).undistort(sensor.plate(pixels)) - ideal).ravel() / sensor.pixel_size_mm[0]
        )

    fitted = camera(np.asarray(least_squares(residuals, np.zeros(4), x_scale="jac").x))
    with np.errstate(all="ignore"):
        errors = fitted.pixels(fitted.distort(ideal)) - pixels
    return fitted, float(np.linalg.norm(errors, axis=1).max())
