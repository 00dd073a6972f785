"""A burst of stereo pairs combined: mean pose of each triad, and breathing.

The errors of a mean over n pairs have three parts. Noise is independent between pairs and falls as 1/n. Errors that all
pairs share (of the calibration, of the light on the balls) do not fall: where the poses scatter less than their stated
covariances, the rest of these is taken as shared and kept whole. Movement that the model leaves is added where the
poses scatter significantly more than stated, divided by the number of pairs that are independent of each other.

What all triads do together cancels in every measure, since these are relative to the reference triad. A plain mean
therefore estimates one common displacement per pair, and only what is left counts as spread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from spinewatch.arrays import Bool, Float
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.tracking.breathing import HarmonicFit, fit_harmonics, peak_to_peak
from spinewatch.tracking.pose_series import PoseSeries, pose_series
from spinewatch.triads.pose import Pose

_STEPS = 50
_MEDIAN_DISTANCE = 2.313
"""Root of the median of chi-square with 6 degrees of freedom."""
_MIN_CORRELATED = 4
"""Least number of residuals whose correlation says anything."""
_MEDIAN_ERROR = 1.25
"""Standard error of a median over that of the mean of normal values."""
_EXCHANGED = [3, 4, 5, 0, 1, 2]
"""Order of the components of a pose with rotation and position exchanged; its own inverse."""


@dataclass(frozen=True)
class BurstParameters:
    """How the pairs of a burst are combined.

    Attributes
    ----------
    period_range_s
        Shortest and longest period of breathing that is searched, s: 30 to 6 breaths a minute.
    n_periods
        Number of periods that are tried first.
    min_cycles
        Least number of cycles between the first and the last pair for a model of breathing.
    min_redundancy
        Least number of pairs beyond the 1 + 2h unknowns of a model with h harmonics.
    max_harmonics
        Largest number of harmonics h.
    min_significance
        Probability, of noise alone, below which breathing or spread is taken as real.
    expected_breathing_mm
        Movement of a vertebra with a breath where it cannot be measured, peak to peak, mm.
    expected_period_s
        Period of breathing where it cannot be measured, s.
    max_unresolved_mm
        Error of the mean by that breathing, RMS over its phase, beyond which a burst is flagged, mm.
    max_outlier_sigma
        Distance of a pose from the model beyond which it is an outlier, in deviations.
    min_pairs_for_outliers
        Least number of poses of a triad among which an outlier can be told.
    max_outlier_share
        Largest share of the poses of a triad that are left out.
    """

    period_range_s: tuple[float, float] = (2.0, 10.0)
    n_periods: int = 120
    min_cycles: float = 1.0
    min_redundancy: int = 2
    max_harmonics: int = 2
    min_significance: float = 1e-3
    expected_breathing_mm: float = 2.0
    expected_period_s: float = 4.0
    max_unresolved_mm: float = 0.1
    max_outlier_sigma: float = 6.0
    min_pairs_for_outliers: int = 4
    max_outlier_share: float = 0.25

    def __post_init__(self) -> None:
        low, high = self.period_range_s
        if not 0 < low < high:
            raise ParameterError("the range of periods must be two positive numbers in ascending order, s")


@dataclass(frozen=True)
class Movement:
    """Breathing movement of a triad.

    Attributes
    ----------
    amplitude_mm, amplitude_sd_mm
        Greatest distance between two positions of the point P in a cycle (peak to peak) and its standard deviation, mm.
    relative_mm, relative_sd_mm
        The same of the movement that an observer on the reference triad sees, mm; None for the reference itself and
        where the reference was not measured.
    """

    amplitude_mm: float
    amplitude_sd_mm: float
    relative_mm: float | None
    relative_sd_mm: float | None


@dataclass(frozen=True)
class Breathing:
    """Breathing in a burst.

    Attributes
    ----------
    period_s, period_sd_s
        Common period of all triads and its standard deviation, s.
    harmonics
        Number of harmonics of the model.
    movements
        Movement by label; triads in too few pairs have none.
    """

    period_s: float
    period_sd_s: float
    harmonics: int
    movements: Mapping[str, Movement]


@dataclass(frozen=True, eq=False)
class BurstResult:
    """Result of a burst.

    Attributes
    ----------
    poses
        Mean pose by label, object space: the constant of the model of breathing, that is the mean over whole cycles, or
        the mean over the pairs.
    breathing
        Breathing; None if it was not found.
    pairs_used
        Number of pairs whose pose is in the mean, by label.
    outliers
        Labels whose pose is left out as an outlier, for each pair.
    shared_position_share, shared_rotation_share
        Shares of the stated covariances of positions and of rotations that were taken as shared by all pairs, 0 to 1.
    flags
        "burst-outlier", "burst-incomplete" and "breathing-unresolved".
    """

    poses: Mapping[str, Pose]
    breathing: Breathing | None
    pairs_used: Mapping[str, int]
    outliers: tuple[tuple[str, ...], ...]
    shared_position_share: float
    shared_rotation_share: float
    flags: tuple[Flag, ...] = field(default=())


def combine_burst(
    pairs: Sequence[Mapping[str, Pose]],
    times_s: Float | None = None,
    reference: str | None = None,
    parameters: BurstParameters | None = None,
) -> BurstResult:
    """Return the mean poses of a burst and the breathing in it.

    Where the times span a cycle and the pairs are enough, harmonics of one common period are fitted, and the mean is
    their constant. Otherwise it is the plain mean.

    Parameters
    ----------
    pairs
        Poses by label, object space, one mapping per pair; a triad may be absent in some.
    times_s
        Time of each pair, shape (n,), s; None if unknown.
    reference
        Label of the reference triad, against which relative movement is given.
    parameters
        Parameters; the default ones if None.

    Returns
    -------
    BurstResult
        Mean poses, breathing and flags.

    Raises
    ------
    ParameterError
        If there is no pair, or not one finite time per pair.

    Examples
    --------
    >>> import numpy as np
    >>> at = lambda x: Pose(np.array([x, 0.0, 0.0]), np.eye(3), np.eye(6))
    >>> result = combine_burst([{"L1": at(0.9)}, {"L1": at(1.1)}])
    >>> float(result.poses["L1"].position_mm[0].round(9)), result.pairs_used
    (1.0, {'L1': 2})
    """
    p = parameters or BurstParameters()
    if not pairs:
        raise ParameterError("a burst needs at least one pair")
    times = None if times_s is None else np.asarray(times_s, dtype=np.float64)
    if times is not None and (times.shape != (len(pairs),) or not np.isfinite(times).all()):
        raise ParameterError(f"give one finite time for each of the {len(pairs)} pairs, or none")
    series = pose_series(pairs)
    if not series.labels:
        return BurstResult({}, None, {}, ((),) * len(pairs), 0.0, 0.0)
    if times is not None:
        times = times - times.mean()
    used, model = _without_outliers(series, times, p)
    shares = _shared_shares(series, used, model)
    means, covariances = _means(series, used, model, shares, p)
    poses = {label: series.pose(i, means[i], covariances[i]) for i, label in enumerate(series.labels)}
    breathing = None if model.fit is None else _breathing(series, model, model.fit, means, reference)
    outliers = tuple(
        tuple(label for i, label in enumerate(series.labels) if series.present[i, k] and not used[i, k])
        for k in range(len(pairs))
    )
    counts = {label: int(used[i].sum()) for i, label in enumerate(series.labels)}
    flags = (*_count_flags(series, outliers), *_breathing_flags(times, len(pairs), model, p))
    return BurstResult(poses, breathing, counts, outliers, *shares, flags)


@dataclass(frozen=True, eq=False)
class _Model:
    """What is fitted to a series: the mean (m, 6) of each label, and the residuals (m, n, 6) of used poses.

    ``freedom`` (m,) are the residuals' degrees of freedom by label; ``fitted`` are the labels of the harmonic fit.
    """

    mean: Float
    residual: Float
    freedom: Float
    fit: HarmonicFit | None = None
    fitted: tuple[int, ...] = ()


def _without_outliers(series: PoseSeries, times: Float | None, p: BurstParameters) -> tuple[Bool, _Model]:
    """Return the poses to use (m, n) and the model; outliers are left out, the worst of each label and pair first."""
    used = series.present.copy()
    while True:
        model = _fit(series, used, times, p)
        distance = np.sqrt(_squared(series, used, model.residual))
        far = np.zeros(used.shape)
        for i, d in enumerate(distance):
            n = int(used[i].sum())
            left_out = int(series.present[i].sum()) - n
            if n < p.min_pairs_for_outliers or left_out + 1 > p.max_outlier_share * (n + left_out):
                continue
            scale = max(float(np.median(d[used[i]])) / _MEDIAN_DISTANCE, 1.0)
            worst = int(d.argmax())
            if d[worst] > p.max_outlier_sigma * scale:
                far[i, worst] = d[worst]
        if not far.any():
            return used, model
        # an outlier displaces the model of its pair, so that the pair's other triads may seem to be far too
        used[far.argmax(axis=0), np.arange(used.shape[1])] &= ~far.any(axis=0)


def _fit(series: PoseSeries, used: Bool, times: Float | None, p: BurstParameters) -> _Model:
    """Return the model with as many harmonics as are significant, which may be none."""
    plain = _plain_model(series, used)
    if times is None:
        return plain
    best = plain
    longest = _longest_period(times, p)
    low, high = p.period_range_s[0], min(p.period_range_s[1], 1.5 * longest)
    chi_square, freedom = _mean_only(series, used)
    for harmonics in range(1, p.max_harmonics + 1):
        enough = used.sum(axis=1) >= 1 + 2 * harmonics + p.min_redundancy
        rows = np.flatnonzero(enough)
        if not len(rows) or high <= low:
            break
        periods = 1 / np.linspace(1 / low, 1 / high, p.n_periods)
        fit = fit_harmonics(
            times,
            series.deviation[rows],
            series.covariance[rows],
            used[rows].astype(np.float64),
            harmonics,
            periods,
        )
        before = float(chi_square[rows].sum()), float(freedom[rows].sum())
        if best.fit is not None:
            before = best.fit.chi_square, best.fit.freedom
        scale = max(fit.chi_square / max(fit.freedom, 1), 1.0)
        gain = (before[0] - fit.chi_square) / scale
        by_chance = chdtrc(max(before[1] - fit.freedom, 1), max(gain, 0.0)) * p.n_periods
        if by_chance > p.min_significance or fit.period_s > longest:
            break
        best = _harmonic_model(series, used, times, fit, tuple(int(i) for i in rows))
    return best


def _longest_period(times: Float, p: BurstParameters) -> float:
    """Return the longest period of which the pairs show enough cycles, s: each stands for the time to the next."""
    n = len(times)
    return float(np.ptp(times)) * n / max(n - 1, 1) / p.min_cycles


def _mean_only(series: PoseSeries, used: Bool) -> tuple[Float, Float]:
    """Return the sums of squares (m,) about each label's own mean and their degrees of freedom (m,)."""
    count = used.sum(axis=1)
    mean = (series.deviation * used[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None]
    residual = (series.deviation - mean[:, None]) * used[..., None]
    return _squared(series, used, residual).sum(axis=1), 6.0 * np.maximum(count - 1, 0)


def _plain_model(series: PoseSeries, used: Bool) -> _Model:
    """Return the means, beside one displacement of all labels per pair whose mean over the pairs is zero."""
    m, n = used.shape
    w = used[..., None].astype(np.float64)
    per_label, per_pair = np.maximum(w.sum(axis=1), 1), np.maximum(w.sum(axis=0), 1)
    mean, common = np.zeros((m, 6)), np.zeros((n, 6))
    for _ in range(_STEPS if not used.all() else 2):
        mean = ((series.deviation - common) * w).sum(axis=1) / per_label
        if m > 1:
            common = ((series.deviation - mean[:, None]) * w).sum(axis=0) / per_pair
            common[:, 3:] = 0.0
            seen = used.any(axis=0)
            common[seen] -= common[seen].mean(axis=0)
    residual = (series.deviation - mean[:, None] - common) * w
    count = used.sum(axis=1)
    pairs = int(used.any(axis=0).sum())
    position = 3.0 * np.maximum(count - 1, 0) * ((1 - 1 / m) if m > 1 and pairs > 1 else 1.0)
    return _Model(mean, residual, position + 3.0 * np.maximum(count - 1, 0))


def _harmonic_model(
    series: PoseSeries, used: Bool, times: Float, fit: HarmonicFit, rows: tuple[int, ...]
) -> _Model:
    """Return the model of a fit; triads in too few pairs take the mean movement of the others."""
    m, _ = used.shape
    mean, residual, freedom = np.zeros((m, 6)), np.zeros(series.deviation.shape), np.zeros(m)
    others = fit.motion(times).mean(axis=0)
    for i in range(m):
        count = int(used[i].sum())
        if i in rows:
            at = rows.index(i)
            mean[i], residual[i] = fit.coefficients[at, 0], fit.residual[at]
            freedom[i] = 6.0 * (count - fit.coefficients.shape[1])
        elif count:
            moved = series.deviation[i] - others
            mean[i] = moved[used[i]].mean(axis=0)
            residual[i] = np.where(used[i, :, None], moved - mean[i], 0.0)
            freedom[i] = 6.0 * (count - 1)
    return _Model(mean, residual, freedom, fit, rows)


def _squared(series: PoseSeries, used: Bool, residual: Float) -> Float:
    """Return squared distances (m, n) of residuals (m, n, 6) in their stated deviations; 0 for unused poses."""
    solved = np.linalg.solve(series.covariance, residual[..., None])[..., 0]
    return np.where(used, np.einsum("ikc,ikc->ik", residual, solved), 0.0)


def _shared_shares(series: PoseSeries, used: Bool, model: _Model) -> tuple[float, float]:
    """Return the shares of the stated covariances that do not show as scatter, less their standard errors.

    The error that the pairs of a burst share is that of the pointing of the cameras: it displaces a triad and hardly
    turns it, so that positions and rotations have shares of their own. The median over three components, each in its
    stated deviation, leaves out the one in which the triads move.
    """
    freedom = float(model.freedom.sum())
    if freedom <= 0:
        return 0.0, 0.0
    squares = np.zeros(6)
    for i in np.flatnonzero(model.freedom > 0):
        root = _root(series.covariance[i, used[i]].mean(axis=0))
        squares += (np.linalg.solve(root, model.residual[i, used[i]].T) ** 2).sum(axis=1)
    rotation, position = (float(np.median(half)) * 6 / freedom for half in (squares[:3], squares[3:]))
    error = _MEDIAN_ERROR * np.sqrt(2 * 2 / freedom)
    shares = (float(np.clip(1 - ratio - error, 0.0, 1.0)) for ratio in (position, rotation))
    return next(shares), next(shares)


def _root(covariance: Float) -> Float:
    """Return a root (6, 6) of a covariance: its first three columns belong to the rotation, the others to the rest."""
    exchanged = np.linalg.cholesky(covariance[np.ix_(_EXCHANGED, _EXCHANGED)])
    return np.asarray(exchanged[_EXCHANGED])


def _means(
    series: PoseSeries, used: Bool, model: _Model, shares: tuple[float, float], p: BurstParameters
) -> tuple[Float, Float]:
    """Return the mean deviations (m, 6) and their covariances (m, 6, 6)."""
    covariances = np.zeros((len(series.labels), 6, 6))
    squared = _squared(series, used, model.residual).sum(axis=1)
    shared = np.repeat(shares[::-1], 3)
    for i in range(len(series.labels)):
        stated = series.covariance[i, used[i]]
        n, typical = len(stated), stated.mean(axis=0)
        if model.fit is not None and i in model.fitted:
            noise = model.fit.covariance[model.fitted.index(i), 0, :, 0, :]
        else:
            noise = typical / n
        root = _root(typical)
        common = root * np.sqrt(shared)
        falling = root * np.sqrt(1 - shared) @ np.linalg.inv(root)
        covariances[i] = common @ common.T + falling @ noise @ falling.T
        freedom = float(model.freedom[i])
        if freedom > 0 and chdtrc(freedom, squared[i]) < p.min_significance:
            residual = model.residual[i, used[i]]
            covariances[i] += _excess(residual, typical, freedom) / _independent(residual, typical)
    return model.mean, covariances


def _excess(residual: Float, typical: Float, freedom: float) -> Float:
    """Return the part (6, 6) of the scatter of residuals (n, 6) that exceeds the stated covariance (6, 6)."""
    root = np.linalg.cholesky(typical)
    whitened = np.linalg.solve(root, residual.T)
    values, vectors = np.linalg.eigh(whitened @ whitened.T * (6 / freedom))
    half = root @ vectors * np.sqrt(np.maximum(values - 1, 0.0))
    return np.asarray(half @ half.T)


def _independent(residual: Float, typical: Float) -> float:
    """Return how many of the residuals (n, 6) are independent, from the correlation of successive ones."""
    n = len(residual)
    if n < _MIN_CORRELATED:
        return 1.0
    whitened = np.linalg.solve(np.linalg.cholesky(typical), residual.T)
    correlation = float((whitened[:, 1:] * whitened[:, :-1]).sum() / (whitened**2).sum())
    correlation = min(max(correlation, 0.0), 1 - 2 / n)
    return max(n * (1 - correlation) / (1 + correlation), 1.0)


def _breathing(
    series: PoseSeries, model: _Model, fit: HarmonicFit, means: Float, reference: str | None
) -> Breathing:
    """Return period and amplitudes of a fit."""
    labels = [series.labels[i] for i in model.fitted]
    at = labels.index(reference) if reference in labels else None
    movements = {}
    for row, (i, label) in enumerate(zip(model.fitted, labels, strict=True)):
        own, own_covariance = fit.coefficients[row, 1:], fit.covariance[row, 1:, :, 1:]
        amplitude = peak_to_peak(own[:, :3], own_covariance[:, :3, :, :3])
        relative: tuple[float | None, float | None] = (None, None)
        if at is not None and at != row:
            lever = (series.position_mm[i] + means[i, :3]) - (
                series.position_mm[model.fitted[at]] + means[model.fitted[at], :3]
            )
            # what the reference's motion does at this triad
            seen = np.hstack([np.eye(3), -cross_matrix(lever) * np.radians(1)])
            moved = own[:, :3] - fit.coefficients[at, 1:] @ seen.T
            turned = np.einsum("ac,qcrd,bd->qarb", seen, fit.covariance[at, 1:, :, 1:], seen)
            relative = peak_to_peak(moved, own_covariance[:, :3, :, :3] + turned)
        movements[label] = Movement(*amplitude, *relative)
    harmonics = (fit.coefficients.shape[1] - 1) // 2
    return Breathing(fit.period_s, fit.period_sd_s, harmonics, movements)


def _count_flags(series: PoseSeries, outliers: Sequence[Sequence[str]]) -> tuple[Flag, ...]:
    """Return flags of triads that are absent or outliers in some pairs."""
    flags = []
    n = series.present.shape[1]
    absent = {label: n - int(row.sum()) for label, row in zip(series.labels, series.present, strict=True)}
    if any(absent.values()):
        parts = ", ".join(f"{label} in {count}" for label, count in absent.items() if count)
        flags.append(Flag("burst-incomplete", f"of {n} pairs, these show no pose of a vertebra: {parts}"))
    if any(outliers):
        parts = ", ".join(f"{'/'.join(out)} in pair {k}" for k, out in enumerate(outliers, start=1) if out)
        flags.append(Flag("burst-outlier", f"far from the other pairs and left out of the mean: {parts}"))
    return tuple(flags)


def _breathing_flags(times: Float | None, n: int, model: _Model, p: BurstParameters) -> tuple[Flag, ...]:
    """Return a flag if breathing is neither fitted nor averaged, and the pairs would not show it either."""
    if model.fit is not None or n == 1:
        return ()
    expected = f"breathing of {p.expected_breathing_mm:g} mm peak to peak every {p.expected_period_s:g} s"
    if times is None:
        detail = f"the pairs have no times: how far {expected} displaces the mean is unknown"
        return (Flag("breathing-unresolved", detail),)
    longest = _longest_period(times, p)
    if n >= 3 + p.min_redundancy and longest >= p.expected_period_s:
        return ()
    phasor = np.abs(np.exp(2j * np.pi * times / p.expected_period_s).mean())
    error = p.expected_breathing_mm / 2 / np.sqrt(2) * float(phasor)
    if error <= p.max_unresolved_mm:
        return ()
    span = float(np.ptp(times))
    detail = (
        f"{n} pairs in {span:.2g} s do not determine breathing: {expected} would displace the mean by {error:.2f} mm"
        " RMS; take more pairs over two breaths or more"
    )
    return (Flag("breathing-unresolved", detail),)
