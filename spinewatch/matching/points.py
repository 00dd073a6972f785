"""From features of two images to points in object space: one feature may yield many points."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.triangulation import triangulate
from spinewatch.matching.epipolar import CandidateParameters, candidate_pairs
from spinewatch.matching.refinement import RefinementParameters, refine_candidates


@dataclass(frozen=True)
class MatcherParameters:
    """Parameters of correspondence.

    ``extra_sd_mrad`` is a pointing error of every ray, 0.26 px on the cart: what calibration and detector do not
    know of their own errors. It widens the search (candidates, covariances, chi2), not the poses that come of it.
    """

    candidates: CandidateParameters = field(default_factory=CandidateParameters)
    refinement: RefinementParameters = field(default_factory=RefinementParameters)
    extra_sd_mrad: float = 0.33


@dataclass(frozen=True, eq=False)
class Points:
    """n points, each of one left and one right feature.

    ``position_mm`` (n, 3); ``covariance_mm2`` (n, 3, 3); ``left_index`` and ``right_index`` (n,) into the
    features; ``parallax_mm`` (n,); ``chi2`` (n,) of the parallax, one degree of freedom; ``score`` (n,) the
    lower score of the two features.
    """

    position_mm: Float
    covariance_mm2: Float
    left_index: NDArray[np.intp]
    right_index: NDArray[np.intp]
    parallax_mm: Float
    chi2: Float
    score: Float

    def __len__(self) -> int:
        return len(self.position_mm)

    def take(self, index: object) -> Points:
        """Return the points chosen by an index or mask array."""
        i = np.asarray(index)
        return Points(*(getattr(self, f.name)[i] for f in fields(self)))


def match_features(
    left: Features,
    right: Features,
    rig: Rig,
    parameters: MatcherParameters,
    images: tuple[NDArray[np.generic], NDArray[np.generic]] | None = None,
) -> Points:
    """Return every point that a left and a right feature may have in common (sections 5.3 to 5.5).

    ``images`` (left, right), 2-D gray, are needed only for structural refinement, which is skipped without
    them. Raises ``ParameterError`` when the range cannot be derived from the rig.
    """
    rays_left = left.rays(rig.left, parameters.extra_sd_mrad)
    rays_right = right.rays(rig.right, parameters.extra_sd_mrad)
    pairs = candidate_pairs(rays_left, rays_right, rig, parameters.candidates)
    if images is not None and parameters.refinement.enabled:
        pairs = refine_candidates(pairs, left, right, images, rig, parameters.refinement)
    found = triangulate([rays_left.take(pairs.left), rays_right.take(pairs.right)])
    return Points(
        position_mm=found.position_mm,
        covariance_mm2=found.covariance_mm2,
        left_index=pairs.left,
        right_index=pairs.right,
        parallax_mm=found.parallax_mm,
        chi2=found.chi2,
        score=np.minimum(left.score[pairs.left], right.score[pairs.right]),
    )
