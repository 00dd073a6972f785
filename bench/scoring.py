"""Comparison of measured stages with the truth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from bench.truth import Scene, Surgery, TrueTriad
from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.imaging.frame import SIDES
from spinewatch.spine.motion import relative_motion
from spinewatch.stage import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import Pose

GATE_MM = 6.0
"""A measured triad farther than this from every true one is false."""

FOUND_MM = 2.0
"""A triad with a smaller position error is found."""

SURE_PX = 0.2
"""The centre of a ball image is sure when its stated standard deviation along both axes is less than this."""

FEATURE_PX = 1.5
"""A visible ball with a feature nearer than this is detected."""


@dataclass(frozen=True, eq=False)
class Match:
    """A true triad and the measured one nearest to it, or None.

    Errors in mm and in degrees about the triad's axes; ``chi2`` holds the chi-squares of the position and of the
    rotation error with the stated covariance, three degrees of freedom each.
    """

    truth: TrueTriad
    measured: LabelledTriad | None
    position_error_mm: float
    rotation_error_deg: Float
    chi2: tuple[float, float]

    @property
    def labelled_correctly(self) -> bool:
        """Whether the triad was measured and has its own label."""
        return self.measured is not None and self.measured.label == self.truth.vertebra

    @property
    def found(self) -> bool:
        """Whether it has its own label and is within 2 mm."""
        return self.labelled_correctly and self.position_error_mm <= FOUND_MM


@dataclass(frozen=True, eq=False)
class StageScore:
    """Score of one stereo pair; ``failure`` is the reason why it could not be measured, or empty.

    ``sure_errors_px``: errors (n, 2) of the sure centres of found triads in each view.
    """

    scene: Scene
    matches: tuple[Match, ...]
    false: int
    recall: tuple[float, ...]
    feature_counts: tuple[int, ...]
    flags: tuple[str, ...]
    total_ms: float
    failure: str = ""
    sure_errors_px: Mapping[str, Float] = field(default_factory=dict)

    @property
    def poses(self) -> dict[str, Pose]:
        """Measured poses of the triads that have their own label."""
        return {
            m.truth.vertebra: m.measured.triad.pose
            for m in self.matches
            if m.measured and m.measured.triad.pose and m.labelled_correctly
        }


@dataclass(frozen=True, eq=False)
class MotionError:
    """Error of a motion since PRE: mm, degrees about the moved reference axes, and the chi-squares of both."""

    translation_mm: float
    rotation_deg: Float
    chi2: tuple[float, float]


def score_stage(scene: Scene, measurement: StageMeasurement, total_ms: float) -> StageScore:
    """Match each true triad, in label order, with the nearest measured triad with a pose that is not matched yet."""
    free = [found for found in measurement.triads if found.triad.pose is not None]
    matches = []
    for truth in scene.triads:
        match = _nearest(truth, free)
        if match.measured is not None:
            free.remove(match.measured)
        matches.append(match)
    features = {side: getattr(measurement, side).features.xy_px for side in SIDES}
    found = [match for match in matches if match.found]
    return StageScore(
        scene=scene,
        matches=tuple(matches),
        false=len(free),
        recall=tuple(_recall(scene, side, xy) for side, xy in features.items()),
        feature_counts=tuple(len(xy) for xy in features.values()),
        flags=tuple(flag.code for flag in measurement.flags),
        total_ms=total_ms,
        sure_errors_px={
            side: _sure_errors(found, getattr(measurement, side).features, side) for side in SIDES
        },
    )


def failed_stage(scene: Scene, reason: str) -> StageScore:
    """Return the score of a pair that could not be measured."""
    nothing = tuple(_missed(truth) for truth in scene.triads)
    return StageScore(scene, nothing, 0, (), (), (), float("nan"), reason)


def score_motion(stages: Mapping[str, StageScore], surgery: Surgery) -> tuple[MotionError, ...]:
    """Return the errors of each motion since PRE, relative to the reference, in every other stage."""
    errors = []
    for stage, truths in surgery.motion.items():
        if stage == "PRE" or not {"PRE", stage} <= set(stages):
            continue
        start, end = stages["PRE"].poses, stages[stage].poses
        if surgery.reference not in start or surgery.reference not in end:
            continue
        for motion in relative_motion(start, end, surgery.reference):
            true = truths[motion.vertebra]
            shift = motion.translation_mm - true.translation_mm
            # in the reference's axes
            rotation = np.degrees(vector_from_rotation(true.rotation @ motion.rotation.T))
            chi2 = (_scaled(shift, motion.translation_sd_mm), _scaled(rotation, motion.rotation_sd_deg))
            errors.append(MotionError(float(np.linalg.norm(shift)), true.rotation.T @ rotation, chi2))
    return tuple(errors)


def summary(scores: Iterable[StageScore], motions: Iterable[MotionError]) -> dict[str, object]:
    """Return the figures over all pairs, by name."""
    scores, motions = list(scores), list(motions)
    every = [match for score in scores for match in score.matches]
    whole = [match for match in every if match.truth.visible]
    partly = [match for match in every if not match.truth.visible]
    good = [match for match in whole if match.found]
    centre = {side: _centre_errors(good, side) for side in SIDES}
    sure = {
        side: np.concatenate(
            [np.empty((0, 2)), *(s.sure_errors_px[side] for s in scores if s.sure_errors_px)]
        )
        for side in SIDES
    }
    rotations = np.array([match.rotation_error_deg for match in good]).reshape(-1, 3)
    motion_rotations = np.array([motion.rotation_deg for motion in motions]).reshape(-1, 3)
    return {
        "pairs": len(scores),
        "failed": sum(bool(score.failure) for score in scores),
        "visible": len(whole),
        "found": len(good),
        "found_pct": _percent(len(good), len(whole)),
        "within1mm_pct": _percent(sum(match.position_error_mm <= 1 for match in good), len(whole)),
        "partial": len(partly),
        "partial_found": sum(match.found for match in partly),
        "unlabelled": sum(match.measured is not None and match.measured.label is None for match in every),
        "mislabelled": sum(match.measured is not None and not match.labelled_correctly for match in every),
        "false": sum(score.false for score in scores),
        "P_rms_mm": rms([match.position_error_mm for match in good]),
        "P_median_mm": _median([match.position_error_mm for match in good]),
        "rot_rms_deg": rms(np.linalg.norm(rotations, axis=1)),
        "rot_median_deg": _median(np.linalg.norm(rotations, axis=1)),
        "inplane_rms_deg": rms(rotations[:, 2]),
        "centre_rms_px": {side: [rms(errors[:, i]) for i in (0, 1)] for side, errors in centre.items()},
        "centre_bias_px": {side: _mean_rows(errors) for side, errors in centre.items()},
        "sure_centres": {side: len(errors) for side, errors in sure.items()},
        "sure_rms_px": {side: [rms(errors[:, i]) for i in (0, 1)] for side, errors in sure.items()},
        "sure_bias_px": {side: _mean_rows(errors) for side, errors in sure.items()},
        "view_shift_rms_px": _view_shifts(scores),
        "feature_recall": _mean([value for score in scores for value in score.recall]),
        "features_per_image": _mean([n for score in scores for n in score.feature_counts]),
        "motion_n": len(motions),
        "motion_t_rms_mm": rms([motion.translation_mm for motion in motions]),
        "motion_rot_rms_deg": rms(np.linalg.norm(motion_rotations, axis=1)),
        "motion_inplane_rms_deg": rms(motion_rotations[:, 2]),
        "uncertainty": {
            "P": uncertainty_scores([match.chi2[0] for match in good]),
            "rotation": uncertainty_scores([match.chi2[1] for match in good]),
            "motion translation": uncertainty_scores([motion.chi2[0] for motion in motions]),
            "motion rotation": uncertainty_scores([motion.chi2[1] for motion in motions]),
        },
        "ms_median": _median([score.total_ms for score in scores if not score.failure]),
    }


def uncertainty_scores(chi_squares: ArrayLike) -> dict[str, float]:
    """Return how chi-squares of 3 degrees of freedom compare with their distribution.

    ``mean``: mean of chi-square over 3, which is 1 when the stated deviations are right and larger when they are too
    small; ``median``: the same ratio of the medians, without influence of outliers; ``within95_pct``: percentage within
    the 95% region.
    """
    values = np.asarray(chi_squares, dtype=np.float64)
    return {
        "n": float(values.size),
        "mean": _mean(values / 3),
        "median": _median(values / stats.chi2.ppf(0.5, 3)),
        "within95_pct": 100 * _mean(values <= stats.chi2.ppf(0.95, 3)),
    }


def rms(values: ArrayLike) -> float:
    """Return the root mean square, NaN without values."""
    array = np.asarray(values, dtype=np.float64)
    return float(np.sqrt(np.mean(array**2))) if array.size else float("nan")


def _nearest(truth: TrueTriad, free: list[LabelledTriad]) -> Match:
    if not free:
        return _missed(truth)
    distance = [float(np.linalg.norm(t.triad.position_mm - truth.position_mm)) for t in free]
    best = int(np.argmin(distance))
    pose = free[best].triad.pose
    if pose is None or distance[best] > GATE_MM:
        return _missed(truth)
    shift = truth.position_mm - pose.position_mm
    rotation = np.degrees(
        vector_from_rotation(truth.rotation @ pose.rotation.T)
    )  # object axes, as the covariance
    chi2 = (_mahalanobis(shift, pose.covariance[:3, :3]), _mahalanobis(rotation, pose.covariance[3:, 3:]))
    return Match(truth, free[best], distance[best], truth.rotation.T @ rotation, chi2)


def _missed(truth: TrueTriad) -> Match:
    return Match(truth, None, float("nan"), np.full(3, np.nan), (float("nan"), float("nan")))


def _recall(scene: Scene, side: str, xy: Float) -> float:
    centres = [triad.centre_px[ball][side] for triad in scene.triads for ball in triad.visible_in[side]]
    if not centres:
        return 1.0
    if not len(xy):
        return 0.0
    gaps = np.linalg.norm(np.array(centres)[:, None] - xy[None], axis=2)
    return float(np.mean(gaps.min(axis=1) < FEATURE_PX))


def _centre_errors(matches: list[Match], side: str) -> Float:
    errors = [
        image - match.truth.centre_px[name][side]
        for match in matches
        if match.measured is not None
        for name, ball in match.measured.triad.balls.items()
        if (image := getattr(ball, f"{side}_px")) is not None
    ]
    return np.array(errors).reshape(-1, 2)


def _sure_errors(matches: list[Match], features: Features, side: str) -> Float:
    """Return the errors (n, 2) of the centres of triads whose features in a view have small stated deviations, px."""
    sd = np.sqrt(np.diagonal(features.covariance_px2, axis1=1, axis2=2)).max(axis=1, initial=0.0)
    sure = features.xy_px[sd < SURE_PX]
    errors = [
        image - match.truth.centre_px[name][side]
        for match in matches
        if match.measured is not None
        for name, ball in match.measured.triad.balls.items()
        if (image := getattr(ball, f"{side}_px")) is not None and np.any(np.all(image == sure, axis=1))
    ]
    return np.array(errors).reshape(-1, 2)


def _view_shifts(scores: Iterable[StageScore]) -> list[float]:
    """Return the RMS over the views of the mean error of their sure centres, along u and v, px."""
    means = [np.mean(e, axis=0) for score in scores for e in score.sure_errors_px.values() if len(e)]
    shifts = np.array(means).reshape(-1, 2)
    return [rms(shifts[:, i]) for i in (0, 1)]


def _mahalanobis(error: Float, covariance: Float) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def _scaled(error: Float, deviations: Float) -> float:
    return float(np.sum((error / deviations) ** 2))


def _percent(part: int, whole: int) -> float:
    return 100 * part / whole if whole else float("nan")


def _mean(values: ArrayLike) -> float:
    array = np.asarray(values, dtype=np.float64)
    return float(array.mean()) if array.size else float("nan")


def _median(values: ArrayLike) -> float:
    array = np.asarray(values, dtype=np.float64)
    return float(np.median(array)) if array.size else float("nan")


def _mean_rows(errors: Float) -> list[float]:
    return [_mean(errors[:, i]) for i in (0, 1)]
