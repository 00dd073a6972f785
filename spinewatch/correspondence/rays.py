"""The rays of image features: undistorted plate coordinates, covariance, and directions in object space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.camera import Camera, Float
from spinewatch.features import Features


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of n features of one camera.

    ``ideal_mm`` (n, 2) undistorted offsets from the principal point; ``covariance_mm2`` (n, 2, 2) of those;
    ``vectors`` (n, 3) = M^T (x, y, -f), the ray in object axes, of the length from the centre to the plate.
    On the undistorted plate epipolar lines are straight and rays are linear, whatever the lens.
    """

    camera: Camera
    ideal_mm: Float
    covariance_mm2: Float
    vectors: Float

    def __len__(self) -> int:
        return len(self.ideal_mm)

    def take(self, index: object) -> Rays:
        """Return the rays chosen by an index array."""
        i = np.asarray(index)
        return Rays(self.camera, self.ideal_mm[i], self.covariance_mm2[i], self.vectors[i])


def feature_rays(camera: Camera, features: Features, extra_sd_mrad: float = 0.0) -> Rays:
    """Return the rays through features; ``extra_sd_mrad``, a pointing error, is added in square to theirs."""
    ideal = camera.undistort(camera.plate(features.xy_px))
    J = camera.undistortion_jacobian(features.xy_px)
    extra_mm = camera.focal_length_mm * extra_sd_mrad / 1000
    S = J @ features.covariance_px2 @ np.swapaxes(J, -1, -2) + extra_mm**2 * np.eye(2)
    V = np.column_stack([ideal, np.full(len(ideal), -camera.focal_length_mm)])
    return Rays(camera, ideal, S, V @ camera.M)
