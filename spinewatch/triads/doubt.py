"""The chance that a triad is false: at a wrong place, or with a wrong ball.

A triad in a wrong place is worse than none. The log-odds of the selection compare a triad with one by chance; they do
not know how reliable the features are in images unlike those of their training. The chance here is a logistic function
of four observations, two of them relative to the other triads of the stage, which have the same light and sharpness.
It was fitted to triads whose truth is known (``python -m bench.doubt``). It holds for features whose deviations the
networks stated; of other features it is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.markers import TriadModel
from spinewatch.matching.insertion import member_gains
from spinewatch.matching.points import Points
from spinewatch.matching.selection_parameters import SelectionParameters, SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.triads.pose import DOUBTFUL, MeasuredTriad

_STATED_DOF = 12.0
"""Weight of the stated deviations against the residuals of the other triads, in degrees of freedom."""

_USUAL_SD = 0.03
"""Standard deviation per axis of the centres of usual balls, radii."""


@dataclass(frozen=True)
class DoubtParameters:
    """The logistic model of the chance, and its limit.

    Attributes
    ----------
    max_chance
        Largest chance of a triad that is given with its pose.
    intercept
        Log-odds of a triad whose observations are all zero.
    gain
        Weight of `TriadEvidence.gain`.
    misfit
        Weight of `TriadEvidence.misfit`.
    spread
        Weight of `TriadEvidence.spread`.
    deviation
        Weight of `TriadEvidence.deviation`.
    max_gain
        Gains are limited to this, and to less than none by a quarter of it.
    """

    max_chance: float = 0.1
    intercept: float = -2.931
    gain: float = -0.458
    misfit: float = 2.375
    spread: float = 2.527
    deviation: float = 2.025
    max_gain: float = 20.0


@dataclass(frozen=True, eq=False)
class TriadEvidence:
    """What is observed of t triads, each without unit and shape (t,).

    Attributes
    ----------
    gain
        What the triad adds to the log-odds of the chain of the others.
    misfit
        Logarithm of 1 + chi-square of its ball images per degree of freedom, over that of the other triads if theirs
        is more than 1.
    spread
        Logarithm of the largest deviation of its ball images over the median of all of the triads.
    deviation
        Logarithm of the mean deviation of its ball images over that of usual balls, in radii of a ball.
    """

    gain: Float
    misfit: Float
    spread: Float
    deviation: Float

    def chances(self, parameters: DoubtParameters) -> Float:
        """Return the chances that the triads are false.

        Parameters
        ----------
        parameters
            The logistic model.

        Returns
        -------
        Float
            Chances, shape (t,).

        Examples
        --------
        >>> observed = [14.0, 4.0], [0.5, 1.2], [0.3, 1.2], [0.0, 1.0]
        >>> evidence = TriadEvidence(*map(np.array, observed))
        >>> evidence.chances(DoubtParameters()).round(3)
        array([0.001, 0.959])
        """
        p = parameters
        log_odds = (
            p.intercept
            + p.gain * self.gain.clip(-p.max_gain / 4, p.max_gain)
            + p.misfit * self.misfit
            + p.spread * self.spread
            + p.deviation * self.deviation
        )
        return np.asarray(1 / (1 + np.exp(-log_odds)))


def triad_evidence(
    triads: Sequence[MeasuredTriad],
    selected: TriadCandidates,
    features: tuple[Features, Features],
    points: Points,
    rig: Rig,
    models: Sequence[TriadModel],
    parameters: SelectionParameters,
    axis: SpineAxis,
) -> TriadEvidence:
    """Return what is observed of triads.

    Parameters
    ----------
    triads
        t measured triads, at least one.
    selected
        Their features and log-odds, in the same order.
    features
        Features of the left and the right image.
    points
        All triangulated points.
    rig
        The calibrated cameras.
    models
        Markers in use.
    parameters
        Prior knowledge of the chain.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    TriadEvidence
        The evidence of each triad.
    """
    spreads = []
    for k, triad in enumerate(triads):
        spread = []
        for of_side, index, camera in zip(
            features, (selected.left[k], selected.right[k]), (rig.left, rig.right), strict=True
        ):
            seen = index[index != HIDDEN]
            depth = camera.depth_mm(triad.position_mm)
            radius = np.array(camera.ball_diameter_px(models[selected.model[k]].ball_diameter_mm, depth)) / 2
            variance = np.diagonal(of_side.covariance_px2[seen], axis1=1, axis2=2) / radius**2
            spread.append(np.sqrt(variance.mean(axis=1)))
        spreads.append(np.concatenate(spread))
    median = float(np.median(np.concatenate(spreads)))
    chi2, dof = np.array([(triad.chi2, max(triad.dof, 1)) for triad in triads]).T
    factor = (_STATED_DOF + chi2.sum() - chi2) / (_STATED_DOF + dof.sum() - dof)
    return TriadEvidence(
        member_gains(selected, points, parameters, axis),
        np.log1p(chi2 / dof / np.maximum(factor, 1)),
        np.log([spread.max() / median for spread in spreads]),
        np.log([spread.mean() / _USUAL_SD for spread in spreads]),
    )


def without_doubtful_poses(
    triads: Sequence[MeasuredTriad], chances: Sequence[float | None], max_chance: float
) -> tuple[MeasuredTriad, ...]:
    """Return triads with the chances that they are false, without the poses of those that may be.

    Parameters
    ----------
    triads
        t measured triads.
    chances
        Chance of each that it is false, t of them; None where it is not known.
    max_chance
        Largest chance with which a triad keeps its pose.

    Returns
    -------
    tuple of MeasuredTriad
        The triads. A ball that a person placed is beyond doubt, and so is its triad: it has no chance.
    """
    return tuple(
        triad if chance is None or _manual(triad) else _rated(triad, chance, max_chance)
        for triad, chance in zip(triads, chances, strict=True)
    )


def without_unsupported_poses(triads: Sequence[MeasuredTriad]) -> tuple[MeasuredTriad, ...]:
    """Return triads, without poses if most are doubtful: the chance of each is computed from the chain of the others.

    Parameters
    ----------
    triads
        Triads of a stage after the last look.

    Returns
    -------
    tuple of MeasuredTriad
        The triads. Those with a ball that a person placed keep their pose.
    """
    count = sum(triad.doubtful for triad in triads)
    if 2 * count <= len(triads):
        return tuple(triads)
    cause = f"so are {count} of the {len(triads) - 1} others"
    return tuple(
        triad if triad.doubtful or _manual(triad) else _without_pose(triad, cause) for triad in triads
    )


def _rated(triad: MeasuredTriad, chance: float, max_chance: float) -> MeasuredTriad:
    """Return a triad with its chance, without its pose if that exceeds the largest one."""
    rated = replace(triad, chance_false=chance)
    if chance <= max_chance:
        return rated
    return _without_pose(rated, f"the chance that it is at a wrong place or has a wrong ball is {chance:.0%}")


def _manual(triad: MeasuredTriad) -> bool:
    return any(ball.manual_in for ball in triad.balls.values())


def _without_pose(triad: MeasuredTriad, cause: str) -> MeasuredTriad:
    """Return a doubtful triad: without its pose, and without the balls that follow from it."""
    balls = {name: ball for name, ball in triad.balls.items() if not ball.hidden_in}
    return replace(triad, balls=balls, pose=None, reason=f"{DOUBTFUL}: {cause}", doubtful=True)
