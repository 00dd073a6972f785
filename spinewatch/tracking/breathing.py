"""Breathing in a series of deviations: harmonics of a period that all labels share.

Deviations are displacements (mm) and rotation vectors (degrees), as in `spinewatch.tracking.pose_series`. The model of
a label is ``y(t) = m + sum_h a_h cos(2 pi h t / T) + b_h sin(2 pi h t / T)``: its constant m is the mean over whole
cycles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from spinewatch.arrays import Float

_PHASES = 72


@dataclass(frozen=True, eq=False)
class HarmonicFit:
    """Harmonics fitted to the deviations of m labels in n pairs.

    Attributes
    ----------
    period_s
        The common period T, s.
    period_sd_s
        Its standard deviation from the noise, s.
    coefficients
        m, a_1, b_1, ... of every label, shape (m, 1 + 2h, 6), mm and degrees.
    covariance
        Their covariance from the noise of the pairs and the period, shape (m, 1 + 2h, 6, 1 + 2h, 6).
    residual
        Deviation minus model, shape (m, n, 6); zero where the weight is.
    chi_square
        Sum of the squared residuals over their stated deviations.
    freedom
        Degrees of freedom of that sum.
    """

    period_s: float
    period_sd_s: float
    coefficients: Float
    covariance: Float
    residual: Float
    chi_square: float
    freedom: int

    def motion(self, times_s: Float) -> Float:
        """Return the motion about the mean.

        Parameters
        ----------
        times_s
            Times, shape (n,), s.

        Returns
        -------
        Float
            Model without its constant, shape (m, n, 6), mm and degrees.
        """
        basis = harmonic_basis(times_s, self.period_s, (self.coefficients.shape[1] - 1) // 2)
        return np.asarray(np.einsum("kq,iqc->ikc", basis[:, 1:], self.coefficients[:, 1:]))


def harmonic_basis(times_s: Float, period_s: float, harmonics: int) -> Float:
    """Return the values of 1, cos, sin, cos 2, sin 2, ... at some times.

    Parameters
    ----------
    times_s
        Times, shape (n,), s.
    period_s
        Period, s.
    harmonics
        Number of harmonics h.

    Returns
    -------
    Float
        Values, shape (n, 1 + 2h).

    Examples
    --------
    >>> import numpy as np
    >>> harmonic_basis(np.array([0.0, 1.0]), 4.0, 1).round(9)
    array([[1., 1., 0.],
           [1., 0., 1.]])
    """
    phase = 2 * np.pi * np.outer(times_s / period_s, np.arange(1, harmonics + 1))
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=-1).reshape(len(times_s), -1)
    return np.column_stack([np.ones(len(times_s)), waves])


def fit_harmonics(
    times_s: Float,
    deviation: Float,
    covariance: Float,
    weight: Float,
    harmonics: int,
    periods_s: Float,
) -> HarmonicFit:
    """Return the harmonics of the period that fits all labels best.

    For a given period the model is linear. The sum of squares is computed for all given periods, and its least value is
    refined between the neighbours of the best one.

    Parameters
    ----------
    times_s
        Time of each pair, shape (n,), s.
    deviation
        Deviations, shape (m, n, 6), mm and degrees.
    covariance
        Their covariances, shape (m, n, 6, 6).
    weight
        Weight of each pose, shape (m, n); 0 leaves it out. Each label needs more than 1 + 2h poses with a weight.
    harmonics
        Number of harmonics h.
    periods_s
        Periods to try, in ascending order, shape (p,), s.

    Returns
    -------
    HarmonicFit
        The fit.

    References
    ----------
    G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose
    variables separate", SIAM J. Numer. Anal. 10 (1973) 413-432: the linear parameters are eliminated.
    """
    roots = [np.linalg.cholesky(_mean(covariance[i], weight[i])) for i in range(len(deviation))]
    whitened = [np.linalg.solve(root, y.T).T for root, y in zip(roots, deviation, strict=True)]

    def chi_square(period: float) -> float:
        basis = harmonic_basis(times_s, period, harmonics)
        total = 0.0
        for y, w in zip(whitened, weight, strict=True):
            gain = _gain(basis, w)
            total += float((w[:, None] * (y - basis @ (gain @ y)) ** 2).sum())
        return total

    values = np.array([chi_square(period) for period in periods_s])
    best = int(values.argmin())
    low, high = periods_s[max(best - 1, 0)], periods_s[min(best + 1, len(periods_s) - 1)]
    found = minimize_scalar(chi_square, bounds=(low, high), method="bounded", options={"xatol": 1e-5})
    period = float(found.x) if found.fun < values[best] else float(periods_s[best])
    least = min(float(found.fun), float(values[best]))
    step = 1e-3 * period
    curvature = (chi_square(period + step) - 2 * least + chi_square(period - step)) / step**2
    period_variance = 2 / curvature if curvature > 0 else np.inf

    coefficients, residual, parts = [], [], []
    basis = harmonic_basis(times_s, period, harmonics)
    earlier, later = (harmonic_basis(times_s, period + s, harmonics) for s in (-step, step))
    for y, C, w in zip(deviation, covariance, weight, strict=True):
        gain = _gain(basis, w)
        x = gain @ y
        slope = (_gain(later, w) @ y - _gain(earlier, w) @ y) / (2 * step)
        noise = np.einsum("qk,kcd,rk->qcrd", gain, C, gain)
        shift = np.einsum("qc,rd->qcrd", slope, slope) * min(period_variance, period**2)
        coefficients.append(x)
        parts.append(noise + shift)
        residual.append(np.where(w[:, None] > 0, y - basis @ x, 0.0))
    count = int((weight > 0).sum())
    freedom = 6 * (count - len(deviation) * basis.shape[1]) - 1
    deviation_s = float(np.sqrt(period_variance))
    return HarmonicFit(
        period, deviation_s, np.stack(coefficients), np.stack(parts), np.stack(residual), least, freedom
    )


def peak_to_peak(coefficients: Float, covariance: Float) -> tuple[float, float]:
    """Return the greatest distance between two positions of a periodic motion.

    Parameters
    ----------
    coefficients
        a_1, b_1, a_2, b_2, ... of the position, shape (2h, 3), mm.
    covariance
        Their covariance, shape (2h, 3, 2h, 3), mm^2.

    Returns
    -------
    amplitude_mm : float
        Peak to peak, mm.
    sd_mm : float
        Its standard deviation to first order, mm. It is meaningful where the amplitude is several times as large.

    Examples
    --------
    >>> import numpy as np
    >>> amplitude, sd = peak_to_peak(np.array([[0.0, 0, 1], [0, 0, 0]]), 0.01 * np.eye(6).reshape(2, 3, 2, 3))
    >>> round(amplitude, 6), round(sd, 6)
    (2.0, 0.2)
    """
    basis = harmonic_basis(np.arange(_PHASES) / _PHASES, 1.0, len(coefficients) // 2)[:, 1:]
    path = basis @ coefficients
    between = path[:, None] - path[None]
    distance = np.linalg.norm(between, axis=-1)
    i, j = np.unravel_index(int(distance.argmax()), distance.shape)
    if distance[i, j] == 0:
        return 0.0, float(2 * np.sqrt(np.trace(np.einsum("qcqd->cd", covariance)) / len(coefficients)))
    along = between[i, j] / distance[i, j]
    gradient = np.outer(basis[i] - basis[j], along)
    variance = float(np.einsum("qc,qcrd,rd", gradient, covariance, gradient))
    return float(distance[i, j]), float(np.sqrt(max(variance, 0.0)))


def _mean(covariance: Float, weight: Float) -> Float:
    """Return the mean (6, 6) of the covariances with a weight."""
    return np.asarray(covariance[weight > 0].mean(axis=0))


def _gain(basis: Float, weight: Float) -> Float:
    """Return the matrix (q, n) from values to the coefficients that fit them best."""
    root = np.sqrt(weight)
    return np.asarray(np.linalg.pinv(basis * root[:, None], rcond=1e-6) * root)
