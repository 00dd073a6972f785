"""From the features of two images to points in object space; one feature may yield several points."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from spinewatch.arrays import Float, Int, Pixels
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.triangulation import triangulate
from spinewatch.matching.epipolar import EpipolarParameters, candidate_pairs
from spinewatch.matching.refinement import RefinementParameters, refine_candidates


@dataclass(frozen=True)
class MatchingParameters:
    """Parameters of the correspondence of features.

    Attributes
    ----------
    epipolar
        Limits of the epipolar candidates.
    refinement
        Comparison of their surroundings.
    extra_sd_mrad
        Pointing error per axis added to every ray, mrad (0.33 is 0.26 px on the cart): errors of calibration and
        detector that their covariances do not contain. It widens the search, not the covariance of poses.
    """

    epipolar: EpipolarParameters = field(default_factory=EpipolarParameters)
    refinement: RefinementParameters = field(default_factory=RefinementParameters)
    extra_sd_mrad: float = 0.33


@dataclass(frozen=True, eq=False)
class Points:
    """n points, each triangulated from one left and one right feature.

    Attributes
    ----------
    position_mm
        Positions, shape (n, 3), object space, mm.
    covariance_mm2
        Their covariances, shape (n, 3, 3), mm^2.
    left_index, right_index
        Indices into the left and the right features, shape (n,).
    parallax_mm
        Distances between the two rays, shape (n,), mm.
    chi2
        Chi-squares of the parallaxes, shape (n,), one degree of freedom.
    log_odds
        Logarithms of the ratio of the parallaxes' likelihood for images of one ball to that for a chance pair, whose
        parallax is uniform within the epipolar tolerance, shape (n,).
    score
        Lower score of the two features, shape (n,).
    """

    position_mm: Float
    covariance_mm2: Float
    left_index: Int
    right_index: Int
    parallax_mm: Float
    chi2: Float
    log_odds: Float
    score: Float

    def __len__(self) -> int:
        return len(self.position_mm)

    def take(self, index: object) -> Points:
        """Return a selection of the points.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        Points
            The selected points, in the order of the index.
        """
        i = np.asarray(index)
        return Points(*(getattr(self, f.name)[i] for f in fields(self)))


def match_features(
    left: Features,
    right: Features,
    rig: Rig,
    ball_diameter_mm: float,
    parameters: MatchingParameters,
    images: tuple[Pixels, Pixels] | None = None,
) -> Points:
    """Return the points of all pairs of a left and a right feature that may be images of one ball.

    Parameters
    ----------
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    ball_diameter_mm
        Diameter of the markers' balls, mm.
    parameters
        Parameters of the correspondence.
    images
        Left and right gray image, shape (H, W); needed for structural refinement, which is skipped without them.

    Returns
    -------
    Points
        Points in order of the left feature.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis sections 5.3 to 5.5.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, balls = large_rig(), np.array([[430.0, 390.0, 90.0], [460.0, 400.0, 95.0]])
    >>> left, right = (
    ...     Features.with_sigma(camera.project(balls), np.ones(2), 0.1) for camera in (rig.left, rig.right)
    ... )
    >>> match_features(left, right, rig, 8.0, MatchingParameters()).position_mm.round(3)
    array([[430., 390.,  90.],
           [460., 400.,  95.]])
    """
    rays_left = left.rays(rig.left, parameters.extra_sd_mrad)
    rays_right = right.rays(rig.right, parameters.extra_sd_mrad)
    pairs = candidate_pairs(rays_left, rays_right, rig, parameters.epipolar)
    if images is not None and parameters.refinement.enabled:
        pairs = refine_candidates(pairs, (left, right), images, rig, ball_diameter_mm, parameters.refinement)
    found = triangulate([rays_left.take(pairs.left), rays_right.take(pairs.right)])
    return Points(
        position_mm=found.position_mm,
        covariance_mm2=found.covariance_mm2,
        left_index=pairs.left,
        right_index=pairs.right,
        parallax_mm=found.parallax_mm,
        chi2=found.chi2,
        log_odds=parallax_log_odds(found.chi2, parameters.epipolar.tolerance_sigma),
        score=np.minimum(left.score[pairs.left], right.score[pairs.right]),
    )


def parallax_log_odds(chi2: Float, tolerance_sigma: float) -> Float:
    """Return the log ratio of the normal density of parallaxes to the uniform one within the tolerance.

    Parameters
    ----------
    chi2
        Chi-squares of the parallaxes, shape (n,), one degree of freedom.
    tolerance_sigma
        Largest distance from an epipolar line, in standard deviations.

    Returns
    -------
    Float
        Log-odds of one ball, shape (n,).
    """
    return np.asarray(-0.5 * (chi2 + np.log(2 * np.pi)) + np.log(2 * tolerance_sigma))
