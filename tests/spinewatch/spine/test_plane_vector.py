import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.plane_vector import (
    PlaneVector,
    deviations_from_zero,
    direction_interval,
    length_interval,
)
from spinewatch.spine.uncertainty import QUANTILE_95

numbers = st.floats(-10, 10, allow_subnormal=False)
deviations = st.floats(0.01, 10)
angles = st.floats(-np.pi, np.pi)


def rotation(angle: float) -> Float:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def vector(d: object, covariance: Float) -> PlaneVector:
    return PlaneVector(np.atleast_2d(np.asarray(d, dtype=float)), covariance)


def covariance(first: float, second: float, angle: float = 0.0) -> Float:
    R = rotation(angle)
    return np.asarray(R @ np.diag([first**2, second**2]) @ R.T)


def direction(v: PlaneVector) -> Float:
    return np.degrees(np.arctan2(v.values[:, 1], v.values[:, 0]))


def test_deviations_from_zero_with_correlated_and_missing_errors() -> None:
    S = np.array([[4.0, 1.0], [1.0, 2.0]])
    assert deviations_from_zero(vector([3, -1], S)) == pytest.approx(
        np.sqrt(np.array([3, -1]) @ np.linalg.inv(S) @ [3, -1])
    )
    assert deviations_from_zero(vector([[3, 0], [0, 1]], np.diag([1.0, 4.0]))) == pytest.approx(0.5)
    assert deviations_from_zero(vector([3, 0], np.diag([4.0, 0.0]))) == pytest.approx(1.5)
    assert deviations_from_zero(vector([3, 1], np.diag([4.0, 0.0]))) > 1e5
    assert deviations_from_zero(vector([3, 1], np.zeros((2, 2)))) == pytest.approx(1e6)
    assert deviations_from_zero(vector([0, 0], np.zeros((2, 2)))) == 0.0


def test_intervals_without_errors_are_the_value() -> None:
    exact = vector([3, 4], np.zeros((2, 2)))
    assert length_interval(exact) == pytest.approx((5.0, 5.0))
    assert direction_interval(direction(exact), exact) == pytest.approx((53.1301, 53.1301), abs=1e-4)
    assert length_interval(vector([0, 0], np.zeros((2, 2)))) == (0.0, 0.0)


@settings(deadline=None, max_examples=50)
@given(st.floats(0.01, 50), angles)
def test_equal_errors_give_the_usual_intervals(size: float, angle: float) -> None:
    v = vector(size * np.array([np.cos(angle), np.sin(angle)]), np.eye(2))
    lower, upper = length_interval(v)
    assert upper == pytest.approx(size + QUANTILE_95)
    assert lower == pytest.approx(size - QUANTILE_95 if size**2 > -2 * np.log(0.05) else 0.0)
    half = 180.0 if size <= QUANTILE_95 else np.degrees(np.arcsin(QUANTILE_95 / size))
    assert np.subtract(direction_interval(direction(v), v), direction(v)[0]) == pytest.approx((-half, half))


@settings(deadline=None, max_examples=100)
@given(numbers, numbers, deviations, deviations, angles)
def test_intervals_contain_the_value(x: float, y: float, first: float, second: float, turn: float) -> None:
    v = vector([x, y], covariance(first, second, turn))
    lower, upper = length_interval(v)
    assert 0 <= lower <= np.hypot(x, y) <= upper
    low, high = direction_interval(direction(v), v)
    assert direction(v)[0] - 180 <= low <= direction(v)[0] <= high <= direction(v)[0] + 180


@settings(deadline=None, max_examples=100)
@given(numbers, numbers, deviations, deviations, angles, angles)
def test_they_turn_with_the_axes(
    x: float, y: float, first: float, second: float, turn: float, by: float
) -> None:
    assume(np.hypot(x, y) > 0.01)
    S, R = covariance(first, second, turn), rotation(by)
    v, w = vector([x, y], S), vector(R @ [x, y], R @ S @ R.T)
    assert deviations_from_zero(w) == pytest.approx(deviations_from_zero(v), rel=1e-6)
    assume(abs(deviations_from_zero(v) ** 2 + 2 * np.log(0.05)) > 1e-3)
    assume(abs(deviations_from_zero(v) - QUANTILE_95) > 1e-3)
    # The lengths are searched in steps of a quarter of a degree.
    assert length_interval(w) == pytest.approx(length_interval(v), abs=0.05 * max(first, second))
    widths = [np.subtract(direction_interval(direction(u), u), direction(u)[0]) for u in (v, w)]
    assert widths[1] == pytest.approx(widths[0], abs=1e-3)


@settings(deadline=None, max_examples=100)
@given(numbers, numbers, deviations, deviations, angles)
def test_a_direction_is_in_the_interval_where_the_part_across_it_is_small(
    x: float, y: float, first: float, second: float, turn: float
) -> None:
    S = covariance(first, second, turn)
    v = vector([x, y], S)
    low, high = direction_interval(direction(v), v)
    a = np.linspace(-np.pi, np.pi, 721)
    n = np.stack([-np.sin(a), np.cos(a)])
    across = (n.T @ [x, y]) ** 2 - QUANTILE_95**2 * np.einsum("ia,ij,ja->a", n, S, n)
    if deviations_from_zero(v) <= QUANTILE_95 * (1 + 1e-6):
        return
    # The set of both senses of each direction; the interval is the part about the measured one.
    found = np.abs(wrapped(np.degrees(a) - (low + high) / 2))
    found = np.minimum(found, 180 - found)
    clear = np.abs(found - (high - low) / 2) > 1e-3
    assert ((across <= 0) == (found <= (high - low) / 2))[clear].all()


def test_an_interval_contains_those_of_the_alternatives() -> None:
    S = np.diag([1.0, 1.0])
    both = vector([[10, 0], [0, 20]], S)
    assert length_interval(both) == pytest.approx((10 - QUANTILE_95, 20 + QUANTILE_95))
    low, high = direction_interval(np.array([0.0, 90.0]), both)
    assert low == pytest.approx(-np.degrees(np.arcsin(QUANTILE_95 / 10)))
    assert high == pytest.approx(90 + np.degrees(np.arcsin(QUANTILE_95 / 20)))


def test_the_whole_circle_where_nothing_is_known() -> None:
    v = vector([1.0, 1.0], np.eye(2))
    assert direction_interval(np.array([45.0]), v) == (-135.0, 225.0)


def test_a_small_angle_with_large_errors_across_has_an_upper_end_above_it() -> None:
    lower, upper = length_interval(vector([1.0, 0.0], np.diag([1.0, 9.0])))
    assert (lower, upper) == pytest.approx((0.0, 3 * QUANTILE_95), abs=0.2)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 10.0])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("length", [0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
def test_the_interval_of_a_length_covers_90_to_98_percent(ratio: float, axis: int, length: float) -> None:
    sd = np.array([ratio, 1.0])
    noise = np.random.default_rng(0).standard_normal((700, 2))
    measured = length * np.eye(2)[axis] + sd * noise
    intervals = np.array([length_interval(vector(d, np.diag(sd**2))) for d in measured])
    covered = np.mean((intervals[:, 0] <= length) & (length <= intervals[:, 1]))
    # Two standard errors of the share.
    assert 0.90 - 0.022 <= covered <= 0.98 + 0.01


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("deviations_long", [0.0, 4.0, 8.0])
def test_a_direction_that_counts_as_known_is_seldom_wrong(axis: int, deviations_long: float) -> None:
    sd = np.array([3.0, 1.0])
    truth = deviations_long * sd * np.eye(2)[axis]
    azimuth = np.degrees(np.arctan2(truth[1], truth[0]))
    known, wrong = 0, 0
    count = 700
    for noise in np.random.default_rng(1).standard_normal((count, 2)):
        v = vector(truth + sd * noise, np.diag(sd**2))
        if deviations_from_zero(v) < 1 / np.radians(20):
            continue
        known += 1
        low, high = direction_interval(direction(v), v)
        inside = abs(wrapped(np.array(azimuth - (low + high) / 2))) <= (high - low) / 2
        wrong += int(deviations_long == 0 or not inside)
    assert wrong <= 0.07 * count
    assert known <= 0.04 * count if deviations_long == 0 else known >= 0.85 * count
