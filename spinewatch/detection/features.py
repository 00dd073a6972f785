"""Image features: the result of detection and the input of matching."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.camera import Camera
from spinewatch.geometry.rays import Rays

HIDDEN = -1
"""Index of a feature that stands for a ball that is hidden in an image."""


@dataclass(frozen=True, eq=False)
class Features:
    """Possible ball centres of one image, best score first.

    Attributes
    ----------
    xy_px
        Centres (u, v), shape (n, 2), px.
    score
        Scores in [0, 1], shape (n,).
    covariance_px2
        Covariances of the centres, shape (n, 2, 2), px^2.
    visible
        Visible fraction of the ball's outline, 0 to 1, shape (n,); None before refinement.
    manual
        Whether a person placed the centre, shape (n,); None when no person did.

    Examples
    --------
    >>> features = Features.with_sigma(np.array([[10.0, 20.0], [30.0, 40.0]]), np.array([0.9, 0.7]), 0.1)
    >>> len(features.take([0]))
    1
    """

    xy_px: Float
    score: Float
    covariance_px2: Float
    visible: Float | None = None
    manual: Bool | None = None

    def __len__(self) -> int:
        return len(self.xy_px)

    @property
    def is_manual(self) -> Bool:
        """Whether a person placed the centre, shape (n,)."""
        return np.zeros(len(self), dtype=bool) if self.manual is None else self.manual

    def take(self, index: object) -> Features:
        """Return a selection of the features.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        Features
            The selected features, in the order of the index.
        """
        i = np.asarray(index)
        visible = None if self.visible is None else self.visible[i]
        manual = None if self.manual is None else self.manual[i]
        return Features(self.xy_px[i], self.score[i], self.covariance_px2[i], visible, manual)

    def best(self, count: int) -> Features:
        """Return the features with the best scores.

        Parameters
        ----------
        count
            Largest number of features.

        Returns
        -------
        Features
            The selected features, best score first.
        """
        return self.take(np.argsort(-self.score, kind="stable")[:count])

    def with_others(self, others: Features) -> Features:
        """Return these features and others.

        Parameters
        ----------
        others
            Other features of the image.

        Returns
        -------
        Features
            All of them, best score first.
        """
        both = (self, others)
        known = all(part.visible is not None for part in both)
        manual = any(part.manual is not None for part in both)
        joined = Features(
            np.concatenate([part.xy_px for part in both]),
            np.concatenate([part.score for part in both]),
            np.concatenate([part.covariance_px2 for part in both]),
            np.concatenate([part.visible for part in both if part.visible is not None]) if known else None,
            np.concatenate([part.is_manual for part in both]) if manual else None,
        )
        return joined.take(np.argsort(-joined.score, kind="stable"))

    def enlarged(self, factor: float | Float, extra_sd_px: tuple[float, float] = (0.0, 0.0)) -> Features:
        """Return the features with larger deviations.

        Parameters
        ----------
        factor
            Factor of all standard deviations, or of those along u and v, shape (2,).
        extra_sd_px
            Standard deviations along u and v, px, added in square.

        Returns
        -------
        Features
            The same centres.
        """
        factors = np.broadcast_to(factor, 2)
        if np.all(factors == 1) and not any(extra_sd_px):
            return self
        covariance = self.covariance_px2 * np.outer(factors, factors) + np.diag(np.square(extra_sd_px))
        return replace(self, covariance_px2=covariance)

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
        """Return no features.

        Returns
        -------
        Features
            Arrays of length 0.
        """
        return cls(np.empty((0, 2)), np.empty(0), np.empty((0, 2, 2)))

    @classmethod
    def with_sigma(cls, xy_px: Float, score: Float, sigma_px: float) -> Features:
        """Return features with equal standard deviations.

        Parameters
        ----------
        xy_px
            Centres (u, v), shape (n, 2), px.
        score
            Scores in [0, 1], shape (n,).
        sigma_px
            Standard deviation per axis, px.

        Returns
        -------
        Features
            n features.
        """
        n = len(xy_px)
        return cls(
            np.asarray(xy_px, dtype=np.float64).reshape(n, 2),
            np.asarray(score, dtype=np.float64).reshape(n),
            np.broadcast_to(np.eye(2) * sigma_px**2, (n, 2, 2)).copy(),
        )


@dataclass(frozen=True, eq=False)
class DiscardedCandidates:
    """Candidates of one image that did not become features, best score first.

    Attributes
    ----------
    xy_px
        Centres of their outlines (u, v), shape (n, 2), px.
    score
        Scores in [0, 1], shape (n,).
    same_ball
        Whether they are the ball of a feature, shape (n,); others have a score too low.
    feature
        Index of that feature, shape (n,); `HIDDEN` for others, and where a person has removed it.
    """

    xy_px: Float
    score: Float
    same_ball: Bool
    feature: Int

    def __len__(self) -> int:
        return len(self.xy_px)

    @classmethod
    def empty(cls) -> DiscardedCandidates:
        """Return no candidates.

        Returns
        -------
        DiscardedCandidates
            Arrays of length 0.
        """
        none = np.empty(0, dtype=bool)
        return cls(np.empty((0, 2)), np.empty(0), none, np.empty(0, dtype=np.intp))

    def beside(self, found: Features, features: Features) -> DiscardedCandidates:
        """Return the candidates with the indices of other features, after edits.

        Parameters
        ----------
        found
            The features that the indices refer to.
        features
            The features to refer to.

        Returns
        -------
        DiscardedCandidates
            The candidates; the same features are those at the same centres.
        """
        place = {tuple(xy): k for k, xy in enumerate(features.xy_px.tolist())}
        feature = [HIDDEN if k == HIDDEN else place.get(tuple(found.xy_px[k]), HIDDEN) for k in self.feature]
        return replace(self, feature=np.array(feature, dtype=np.intp))
