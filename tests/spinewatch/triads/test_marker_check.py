"""Markers that explain the balls of a pair better than the one given."""

import numpy as np
import pytest

from spinewatch.markers import FLAT_10_14_18, TriadModel, flat_triad, orthogonal_triad
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.marker_check import marker_flags
from spinewatch.triads.search import SearchParameters, match_triads

RIG, SEARCH = large_rig(), SearchParameters()


def seen(seed: int, *, hidden_balls: int = 0) -> Observation:
    rng = np.random.default_rng(seed)
    noise = FeatureNoise(0.1, false_features=15)
    hidden = [(ball, "left") for ball in range(hidden_balls)]
    return observe(RIG, random_spine(rng, 4, spacing_mm=45), rng, noise, hidden=hidden)  # type: ignore[arg-type]


def details(observed: Observation, model: TriadModel, expected: int | None = 4) -> list[str]:
    pair = observed.left, observed.right
    found = match_triads(*pair, RIG, SEARCH, expected=expected, axis="x", models=[model])
    flags = marker_flags(found.triads, pair, RIG, SEARCH, [model], expected=expected, axis="x")
    return [flag.detail for flag in flags]


@pytest.mark.parametrize("expected", [4, None])
@pytest.mark.parametrize("legs", [(10, 14, 18), (18, 10, 14), (14, 18, 10), (36, 28, 20), (180, 140, 100)])
def test_another_order_or_unit_is_named(legs: tuple[float, float, float], expected: int | None) -> None:
    (detail,) = details(seen(1), flat_triad(*legs), expected)
    assert "4 triads in full view fit the marker flat:18,14,10" in detail


def test_the_marker_of_the_thesis_is_named_for_another_kind() -> None:
    (detail,) = details(seen(2), orthogonal_triad(30, 22, 16))
    assert "fit the marker flat-10-14-18" in detail


def test_the_right_marker_is_no_doubt_with_every_ball_in_view_or_with_hidden_ones() -> None:
    for seed in range(4):
        assert details(seen(seed), FLAT_10_14_18) == []
        assert details(seen(seed, hidden_balls=10), FLAT_10_14_18) == []
