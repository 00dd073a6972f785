"""Exposures of the two views at different times: what a vertebra that breathes moves between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.matching.epipolar import EpipolarParameters, nominal_ranges_mm


@dataclass(frozen=True)
class SynchronizationParameters:
    """Expected breathing, and the error that it may cause.

    Attributes
    ----------
    breathing_mm
        Movement of a vertebra with a breath, peak to peak, mm.
    breaths_per_minute
        Breaths in a minute.
    max_error_mm
        Largest error of a point by a delay between the views, mm.

    References
    ----------
    PMC6686387: breathing moves a vertebra by 2.0 mm, standard deviation 1.3 mm.
    """

    breathing_mm: float = 2.0
    breaths_per_minute: float = 15.0
    max_error_mm: float = 0.1

    def __post_init__(self) -> None:
        if min(self.breathing_mm, self.breaths_per_minute, self.max_error_mm) <= 0:
            raise ParameterError("breathing and the largest error by a delay must be positive")

    @property
    def period_s(self) -> float:
        """Period of breathing, s."""
        return 60 / self.breaths_per_minute


def expected_movement_mm(delay_s: float, parameters: SynchronizationParameters | None = None) -> float:
    """Return how far breathing may move a vertebra within a delay.

    The largest difference of a sine of peak to peak A and period T over a delay d is ``A |sin(pi d / T)|``, and A for
    delays of half a period and more.

    Parameters
    ----------
    delay_s
        Delay, s, of either sign.
    parameters
        Expected breathing; the default one if None.

    Returns
    -------
    float
        Movement, mm.

    Examples
    --------
    >>> round(expected_movement_mm(2 / 3), 9), expected_movement_mm(60.0)
    (1.0, 2.0)
    """
    p = parameters or SynchronizationParameters()
    return float(p.breathing_mm * np.sin(np.pi * min(abs(delay_s) / p.period_s, 0.5)))


def parallax_gain(rig: Rig, parameters: EpipolarParameters | None = None) -> float:
    """Return the largest error of a point for a movement of 1 mm between the exposures.

    A movement d across the right ray displaces the intersection along the left ray by ``d / sin(c)``, where c is the
    angle between the rays.

    Parameters
    ----------
    rig
        The calibrated cameras.
    parameters
        Range of the markers; that of the rig's axes if None.

    Returns
    -------
    float
        Error over movement, at the middle of the range.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.
    """
    range_mm = float(np.mean(nominal_ranges_mm(rig, parameters or EpipolarParameters())))
    return float(1 / np.sin(2 * np.arctan(rig.baseline_mm / (2 * range_mm))))


def max_delay_s(gain: float, parameters: SynchronizationParameters | None = None) -> float:
    """Return the delay between the views at which the expected error of a point reaches its limit.

    Parameters
    ----------
    gain
        Error over movement (`parallax_gain`).
    parameters
        Expected breathing and limit; the default ones if None.

    Returns
    -------
    float
        Delay, s; infinite if no delay reaches the limit.

    Examples
    --------
    >>> round(max_delay_s(2.0), 4)
    0.0318
    """
    p = parameters or SynchronizationParameters()
    share = p.max_error_mm / (gain * p.breathing_mm)
    return float(p.period_s / np.pi * np.arcsin(share)) if share < 1 else float("inf")


def delay_flags(
    delays_s: Sequence[float], gain: float, parameters: SynchronizationParameters | None = None
) -> tuple[Flag, ...]:
    """Return a flag if the views of a pair were exposed too far apart in time.

    Parameters
    ----------
    delays_s
        Time of the right exposure minus that of the left one for each pair, s.
    gain
        Error over movement (`parallax_gain`).
    parameters
        Expected breathing and limit; the default ones if None.

    Returns
    -------
    tuple of Flag
        "views-not-synchronous" with the largest delay, or none.

    Examples
    --------
    >>> delay_flags([0.0, 0.01], 1.9)
    ()
    >>> delay_flags([0.0, -0.5], 1.9)[0].code
    'views-not-synchronous'
    """
    p = parameters or SynchronizationParameters()
    limit = max_delay_s(gain, p)
    late = [delay for delay in delays_s if abs(delay) > limit]
    if not late:
        return ()
    worst = max(late, key=abs)
    later = "right" if worst > 0 else "left"
    movement = expected_movement_mm(worst, p)
    pairs = f", and {len(late)} of {len(delays_s)} pairs are beyond the limit" if len(delays_s) > 1 else ""
    detail = (
        f"the {later} view was exposed {_span(worst)} after the other one{pairs}; breathing of {p.breathing_mm:g} mm at"
        f" {p.breaths_per_minute:g} a minute moves a vertebra up to {movement:.2f} mm in that time, an error of up to"
        f" {movement * gain:.2f} mm; at most {_span(limit)} are allowed: trigger both cameras together"
    )
    return (Flag("views-not-synchronous", detail),)


def _span(seconds: float) -> str:
    return f"{abs(seconds) * 1000:.0f} ms" if abs(seconds) < 10 else f"{abs(seconds):.0f} s"
