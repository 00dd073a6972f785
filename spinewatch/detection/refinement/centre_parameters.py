"""Parameters of the centres of balls: of proposals, of their refinement, and of what a person edits."""

from __future__ import annotations

from dataclasses import dataclass, field

from spinewatch.detection.refinement.look import LookParameters


@dataclass(frozen=True)
class PlacedParameters:
    """What centres that a person places are compared with; lengths in radii of the ball.

    Attributes
    ----------
    unconfirmed_sd
        Standard deviation per axis of a placed centre where nothing like a ball was detected, and of the mean of all
        such centres in an image: 1 px for a ball of 10 px. It is assumed, not measured: the centre of a ball of which
        a half is hidden follows from an arc of its outline.
    min_score
        Least score of a feature that counts as like a ball. 94% of 304 balls in view in rendered scenes have it, 77% of
        544 under harder light, and one of the other features of an image.
    reach
        Greatest distance of the feature that one placed centre is compared with.
    group_reach
        The same for the placed centres of a triad that are displaced together: the shape of the triad tells which
        features are meant.
    max_sd
        Greatest distance of a centre that was placed on a feature, in standard deviations.
    """

    unconfirmed_sd: float = 0.2
    min_score: float = 0.68
    reach: float = 3.0
    group_reach: float = 10.0
    max_sd: float = 4.0


@dataclass(frozen=True)
class CentreParameters:
    """Parameters of `propose` and `refine`, and of the centres that a person edits; lengths in radii of the ball.

    `spinewatch.detection.manual` uses ``merge_radius`` and ``manual_sd``.

    Attributes
    ----------
    n_shared
        Number of best proposals per view from which the size of the balls and the light are estimated.
    n_refined
        Number of best proposals per view that are refined.
    n_rotated
        Number of the best of these that are refined in all orientations.
    n_kept
        Number of features per view to return at most.
    min_odds
        Least odds of a ball for an estimate to contribute to the size of the balls and the light.
    min_balls
        Least number of such estimates. With fewer the nominal size holds, and the light counts as not measured.
    height
        Height of the balls over the tissue, with which the networks expect their shadows; 9.5 is the middle of the
        worlds that they were fitted to, 38 mm for balls of 8 mm.
    lamp_sd_rad
        Standard deviation per axis of the lamp's direction about that of the point midway between the cameras, radians.
    merge_radius
        Features whose centres are closer than this are one.
    max_shift
        Greatest distance per axis of a centre from its candidate.
    rotation_correlation
        Correlation of the errors of two orientations, measured on simulated images.
    model_sd
        Standard deviation per axis of errors on real images that simulated images do not have.
    max_log_odds
        A network's log-odds are clipped to this magnitude.
    template_weight
        Log-odds that correspond to a template similarity of 1; a blood clot may deceive either criterion.
    manual_sd
        Standard deviation per axis of a centre that a person places in an enlarged image: 0.6 px for a ball of 10 px.
    placed
        What centres that a person places are compared with.
    look
        Limits of a usual look.
    """

    n_shared: int = 24
    n_refined: int = 60
    n_rotated: int = 24
    n_kept: int = 150
    min_odds: float = 30.0
    min_balls: int = 4
    height: float = 9.5
    lamp_sd_rad: float = 0.11
    merge_radius: float = 0.4
    max_shift: float = 0.7
    rotation_correlation: float = 0.8
    model_sd: float = 0.008
    max_log_odds: float = 6.0
    template_weight: float = 20.0
    manual_sd: float = 0.12
    placed: PlacedParameters = field(default_factory=PlacedParameters)
    look: LookParameters = field(default_factory=LookParameters)
