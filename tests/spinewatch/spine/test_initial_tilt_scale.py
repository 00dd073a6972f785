"""Tilts that are 0, halved or doubled differ from the line of the centroids; sound ones and vague ones do not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, ScoliosisParameters, random_scoliosis
from spinewatch.spine.initial_tilt_scale import TiltScaleParameters, directions_deg, tilt_scale_doubt
from spinewatch.spine.initial_tilts import initial_tilt_flags
from spinewatch.spine.orientation import rotation_from_tilts, tilts_of

ALL = np.arange(len(LEVELS))
LARGE = ScoliosisParameters(cobb_deg=(35.0, 70.0))


def spine(
    seed: int, parameters: ScoliosisParameters | None = LARGE, sd_deg: float = 3.0
) -> tuple[Float, Float]:
    """Return centroids (17, 3) and tilts (17, 2) of a simulated spine with errors."""
    rng = np.random.default_rng(seed)
    own = random_scoliosis(rng, list(CurveKind)[seed % 3], parameters)
    tilts = np.stack(tilts_of(own.rotation)[:2], axis=1) + sd_deg * rng.standard_normal((17, 2))
    position = own.poses.position_mm + 2.0 * rng.standard_normal((17, 3))
    return position @ rotation_from_vector(np.radians(3.0) * rng.standard_normal(3)).T, tilts


@pytest.mark.parametrize("parameters", [LARGE, None, ScoliosisParameters(cobb_deg=(1.0, 15.0))])
def test_sound_spines_raise_nothing(parameters: ScoliosisParameters | None) -> None:
    alarms = 0
    for seed in range(100):
        position, tilts = spine(seed, parameters, sd_deg=(3.0, 6.0)[seed % 2])
        rng = np.random.default_rng(seed)
        rows = np.sort(rng.choice(17, rng.integers(3, 18), replace=False))
        alarms += any(tilt_scale_doubt(rows, position[rows], tilts[rows, k], k) for k in (0, 1))
    assert alarms <= 1


@pytest.mark.parametrize(("scale", "least"), [(0.0, 20), (0.5, 12), (2.0, 16)])
def test_tilts_of_another_size_are_seen(scale: float, least: int) -> None:
    found = []
    for seed in range(20):
        position, tilts = spine(seed)
        found.append(tilt_scale_doubt(ALL, position, scale * tilts[:, 0], 0))
    told = [doubt for doubt in found if doubt]
    assert len(told) >= least
    if scale:
        slopes = [float(doubt.removeprefix("are ").split(" ")[0]) for doubt in told]
        assert np.median(slopes) == pytest.approx(scale, rel=0.2)
        assert all("check that every tilt was read" in doubt for doubt in told)
    else:
        assert all("are all 0" in doubt and "give the tilt" in doubt for doubt in told)


def test_a_line_that_does_not_rise_says_nothing_of_the_size() -> None:
    position, tilts = spine(1)
    for rise in (0.0, -1.0):
        assert tilt_scale_doubt(ALL, position * (1, 1, rise), 0.5 * tilts[:, 0], 0) is None


def test_the_sagittal_plane_is_compared_too() -> None:
    position, tilts = spine(4, ScoliosisParameters(cobb_deg=(1.0, 5.0), kyphosis_deg=(60.0, 70.0)))
    assert tilt_scale_doubt(ALL, position, tilts[:, 1], 1) is None
    assert tilt_scale_doubt(ALL, position, 0 * tilts[:, 1], 1)


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), lean=st.floats(-20, 20))
def test_a_common_tilt_changes_nothing(seed: int, lean: float) -> None:
    position, tilts = spine(seed)
    scaled = 0.5 * tilts[:, 0]
    expected = tilt_scale_doubt(ALL, position, scaled, 0)
    assert tilt_scale_doubt(ALL, position, scaled + lean, 0) == expected


def test_zeros_along_a_straight_line_say_nothing() -> None:
    straight = np.stack([np.zeros(17), 0.5 * np.sin(ALL), -28.0 * ALL], axis=1)
    assert tilt_scale_doubt(ALL, straight, np.zeros(17), 0) is None
    assert tilt_scale_doubt(ALL, straight * (0, 0, 1), np.zeros(17), 0) is None


def test_few_or_distant_vertebrae_say_nothing() -> None:
    position, tilts = spine(0)
    for rows in (ALL[:2], ALL[::6], ALL[[0, 1, 8, 16]]):
        assert tilt_scale_doubt(rows, position[rows], 0 * tilts[rows, 0], 0) is None


def test_stated_deviations_count_where_they_are_larger() -> None:
    position, tilts = spine(3)
    scaled = 0.4 * tilts[:, 0]
    for sd, doubtful in (((1.0, 1.0), True), ((30.0, 3.0), False), ((2.0, 40.0), False)):
        assert bool(tilt_scale_doubt(ALL, position, scaled, 0, np.tile(sd, (17, 1)))) == doubtful


def test_parameters_are_used() -> None:
    position, tilts = spine(3)
    assert tilt_scale_doubt(ALL, position, 0.5 * tilts[:, 0], 0)
    wide = TiltScaleParameters(min_slope=0.1)
    assert tilt_scale_doubt(ALL, position, 0.5 * tilts[:, 0], 0, None, wide) is None


def test_directions_are_the_tilts_of_an_axis_along_the_step() -> None:
    tilts = np.array([[20.0, -10.0], [-35.0, 15.0]])
    z = np.stack([rotation_from_tilts(row[0], row[1], 0.0)[:, 2] for row in tilts])
    np.testing.assert_allclose(directions_deg(30.0 * z), tilts, atol=1e-9)


def test_the_flag_names_the_plane() -> None:
    position, tilts = spine(1)
    R = np.stack([rotation_from_tilts(0.0, row[1], 0.0) for row in tilts])
    (flag,) = initial_tilt_flags(LEVELS, ALL, position, R)
    assert flag.code == "initial-tilts-doubtful"
    assert flag.detail.startswith("coronal tilts are all 0")
    stated = np.tile([60.0, 60.0], (17, 1))
    assert initial_tilt_flags(LEVELS, ALL, position, R, stated_sd=stated) == ()
