from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from spinewatch.arrays import Float
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.displacements import (
    Base,
    BodiesCoincideError,
    add_source,
    fill_positions,
    interpolation_source,
    is_known,
    knots_and_between,
    spine_places,
    spread_errors,
)
from spinewatch.spine.interpolation_model import InterpolationParameters
from tests.spinewatch.spine.simulated import turn

NAN = [np.nan] * 3


def test_places_are_lengths_in_mean_levels_by_hand() -> None:
    position = np.array([NAN, [0.0, 0, 100], [0, 0, 80], NAN, [0, 0, 20], [0, 0, 10], NAN])
    # 90 mm over 4 levels; the unknown body is half-way along its 60 mm.
    assert np.allclose(spine_places(position)[1:-1], np.array([0, 20, 50, 80, 90]) / 22.5)
    assert np.isnan(spine_places(position)[[0, -1]]).all()


def test_bodies_in_one_place_are_refused() -> None:
    with pytest.raises(BodiesCoincideError, match="coincide"):
        spine_places(np.zeros((2, 3)))


def test_known_values() -> None:
    rotations = np.stack([np.eye(3), np.full((3, 3), np.nan)])
    assert list(is_known(rotations)) == [True, False]
    assert list(is_known(np.array([NAN, [0.0, 0, 0]]))) == [False, True]


def test_what_is_between_knots() -> None:
    known = np.array([False, True, False, False, True, False])
    possible = np.array([True, True, True, False, True, True])
    knots, at = knots_and_between(known, possible)
    assert (list(knots), list(at)) == ([1, 4], [2])
    knots, at = knots_and_between(np.array([True, False]), np.array([True, True]))
    assert (len(knots), len(at)) == (0, 0)


def filled(position: Float, base: Float, errors: dict[str, Float] | None = None) -> Float:
    poses = SpinePoses(base, np.tile(np.eye(3), (len(base), 1, 1)))
    return fill_positions(
        position,
        {} if errors is None else errors,
        Base(poses, {}, spine_places(base)),
        interpolation_source("POST"),
        InterpolationParameters(),
    )


def test_displacements_follow_a_natural_spline() -> None:
    rng = np.random.default_rng(3)
    base = np.column_stack([rng.normal(0, 5, 7), rng.normal(0, 5, 7), -30.0 * np.arange(7)])
    position = base + rng.normal(0, 10, (7, 3))
    knots, at = [0, 2, 3, 6], [1, 4, 5]
    known = position.copy()
    known[at] = np.nan
    places = spine_places(base)
    expected = base[at] + CubicSpline(places[knots], (position - base)[knots], bc_type="natural")(places[at])
    result = filled(known, base)
    assert np.allclose(result[at], expected)
    assert np.array_equal(result[knots], position[knots])


def test_one_known_body_places_no_other() -> None:
    base = np.outer(np.arange(3.0), [0, 0, -30])
    position = base.copy()
    position[1:] = np.nan
    errors: dict[str, Float] = {}
    assert np.isnan(filled(position, base, errors)[1:]).all()
    assert errors == {}


def test_errors_of_a_body_between_two_by_hand() -> None:
    # Half-way: the base's own error, and half of the knots' errors less the base's there, turned by the motion.
    n, at, knots = 3, np.array([1]), np.array([0, 2])
    base = {"initial": np.zeros((n, 6, 1))}
    base["initial"][:, 0, 0] = 2.0, 4.0, 6.0
    errors = {"initial": np.zeros((n, 6, 1)), "triads POST": np.zeros((n, 6, 1))}
    errors["triads POST"][[0, 2], 1, 0] = 3.0, 5.0
    quarter = np.stack([turn(0, 0, 90)] * n)
    spread_errors(errors, base, knots, at, np.full((1, 2, 1, 1), 0.5) * np.eye(3), slice(0, 3), quarter)
    assert np.allclose(errors["triads POST"][1, :, 0], [0, 4, 0, 0, 0, 0])
    # Turned by 90 degrees, x is y: 4 of its own less the mean of 2 and 6.
    assert np.allclose(errors["initial"][1, :, 0], [0, 0, 0, 0, 0, 0])
    errors["initial"][[0, 2], 1, 0] = 2.0, 6.0
    spread_errors(errors, base, knots, at, np.full((1, 2, 1, 1), 0.5) * np.eye(3), slice(0, 3), quarter)
    assert np.allclose(errors["initial"][1, :, 0], [0, 4, 0, 0, 0, 0])


def test_a_source_collects_columns() -> None:
    errors: dict[str, Float] = {}
    add_source(errors, "s", 3, np.array([1]), slice(0, 3), np.ones((1, 3, 2)))
    add_source(errors, "s", 3, np.array([1]), slice(3, 6), 2 * np.ones((1, 3, 1)))
    assert errors["s"].shape == (3, 6, 3)
    assert np.allclose(errors["s"][1], [[1, 1, 0]] * 3 + [[0, 0, 2]] * 3)
    assert not errors["s"][[0, 2]].any()
