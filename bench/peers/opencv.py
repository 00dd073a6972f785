"""OpenCV's calibrateCamera and stereoCalibrate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.points import ImagePoints, Sensor


@dataclass(frozen=True, eq=False)
class OpenCv:
    """An OpenCV camera placed in the first board's frame: K, dist, R, t, and the RMS per point, px."""

    K: Float
    dist: Float
    R: Float
    t: Float
    rms_px: float

    def project(self, points_mm: Float) -> Float:
        """Return pixels (n, 2) of object points (n, 3)."""
        image, _ = cv2.projectPoints(points_mm, cv2.Rodrigues(self.R)[0], self.t, self.K, self.dist)
        return np.asarray(image[:, 0], dtype=np.float64)


def opencv_camera(
    images: Sequence[ImagePoints], sensor: Sensor, focal_mm: float | None, flags: int = 0
) -> OpenCv:
    """Return calibrateCamera's result; ``focal_mm`` is the initial value for a field in relief, None for planes."""
    X = [np.ascontiguousarray(i.control_mm, dtype=np.float32) for i in images]
    U = [np.ascontiguousarray(i.pixels, dtype=np.float32) for i in images]
    K, given = np.eye(3), cv2.CALIB_FIX_K3 | flags
    if focal_mm is not None:
        px, py = sensor.pixel_size_mm
        w, h = sensor.image_size_px
        K = np.array([[focal_mm / px, 0, (w - 1) / 2], [0, focal_mm / py, (h - 1) / 2], [0, 0, 1]])
        given |= cv2.CALIB_USE_INTRINSIC_GUESS
    rms, K_out, dist, r, t = cv2.calibrateCamera(X, U, sensor.image_size_px, K, np.zeros(5), flags=given)
    R = cv2.Rodrigues(r[0])[0]
    return OpenCv(_float(K_out), _float(dist), _float(R), _float(t[0]).ravel(), float(rms))


def opencv_stereo(
    left: Sequence[ImagePoints], right: Sequence[ImagePoints], cameras: tuple[OpenCv, OpenCv], sensor: Sensor
) -> tuple[float, Float, Float]:
    """Return stereoCalibrate's RMS per point, px, and R, t from left to right; the interiors are adjusted too."""
    X = [np.ascontiguousarray(i.control_mm, dtype=np.float32) for i in left]
    U = [np.ascontiguousarray(i.pixels, dtype=np.float32) for i in left]
    V = [np.ascontiguousarray(i.pixels, dtype=np.float32) for i in right]
    (a, b), flags = cameras, cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
    end = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-9)
    rms, *_, R, t, _, _ = cv2.stereoCalibrate(
        X,
        U,
        V,
        a.K.copy(),
        a.dist.copy(),
        b.K.copy(),
        b.dist.copy(),
        sensor.image_size_px,
        flags=flags,
        criteria=end,
    )
    return float(rms), _float(R), _float(t).ravel()


def triangulate(left: OpenCv, right: OpenCv, left_px: Float, right_px: Float) -> Float:
    """Return the points (n, 3) by undistortPoints and triangulatePoints."""
    rays = []
    for camera, pixels in ((left, left_px), (right, right_px)):
        ideal = cv2.undistortPoints(np.ascontiguousarray(pixels)[:, None], camera.K, camera.dist)[:, 0]
        rays.append((np.column_stack([camera.R, camera.t]), ideal.T))
    X = cv2.triangulatePoints(rays[0][0], rays[1][0], rays[0][1], rays[1][1])
    return np.asarray((X[:3] / X[3]).T)


def _float(array: object) -> Float:
    return np.asarray(array, dtype=np.float64)
