"""Image features: what detection hands to correspondence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.geometry.rays import Rays


@dataclass(frozen=True, eq=False)
class Features:
    """Possible ball centres of one image, best score first.

    ``xy_px`` (n, 2) u, v; ``score`` (n,) similarity in [0, 1]; ``covariance_px2`` (n, 2, 2) of the centre;
    ``visible`` (n,), the fraction of the ball's outline that is seen, 0 to 1, or None when nobody has looked.
    """

    xy_px: Float
    score: Float
    covariance_px2: Float
    visible: Float | None = None

    def __len__(self) -> int:
        return len(self.xy_px)

    def take(self, index: object) -> Features:
        """Return the features chosen by an index or mask array."""
        i = np.asarray(index)
        visible = None if self.visible is None else self.visible[i]
        return Features(self.xy_px[i], self.score[i], self.covariance_px2[i], visible)

    def rays(self, camera: Camera, extra_sd_mrad: float = 0.0) -> Rays:
        """Return the rays of the features with their uncertainty.

        Parameters
        ----------
        camera
            The camera that took the image.
        extra_sd_mrad
            Pointing error per axis, mrad, added in square to the features' own.

        Returns
        -------
        Rays
            One ray per feature.

        """
        return camera.rays(self.xy_px, self.covariance_px2, extra_sd_mrad)

    @classmethod
    def empty(cls) -> Features:
        """Return a list without features."""
        return cls(np.empty((0, 2)), np.empty(0), np.empty((0, 2, 2)))

    @classmethod
    def with_sigma(cls, xy_px: Float, score: Float, sigma_px: float) -> Features:
        """Return features that share one standard deviation, px per axis."""
        n = len(xy_px)
        return cls(
            np.asarray(xy_px, dtype=np.float64).reshape(n, 2),
            np.asarray(score, dtype=np.float64).reshape(n),
            np.broadcast_to(np.eye(2) * sigma_px**2, (n, 2, 2)).copy(),
        )
