from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.levels import level_numbers
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, ScoliosisParameters, random_scoliosis
from spinewatch.spine.initial_tilts import InitialTiltParameters, InitialTiltsError, initial_tilt_flags
from spinewatch.spine.orientation import rotation_from_tilts, tilts_of

EVERY_OTHER = tuple(range(4, 14, 2))
MILD = ScoliosisParameters(cobb_deg=(0.5, 15.0), kyphosis_deg=(2.0, 45.0), lordosis_deg=(10.0, 55.0))
DRAWS = 200


def spine(seed: int = 0, parameters: ScoliosisParameters | None = None) -> tuple[Float, Float]:
    """Return centroids (17, 3) and tilts (17, 3) of a simulated spine, errors of 6 degrees and 2 mm (sd)."""
    rng = np.random.default_rng(seed)
    simulated = random_scoliosis(rng, list(CurveKind)[seed % 3], parameters)
    tilts = np.stack(tilts_of(simulated.rotation), axis=1) + 6.0 * rng.standard_normal((17, 3))
    return simulated.poses.position_mm + 2.0 * rng.standard_normal((17, 3)), tilts


def doubts(
    position: Float,
    tilts: Float,
    levels: Sequence[int] = range(17),
    parameters: InitialTiltParameters | None = None,
) -> list[str]:
    chosen = list(levels)
    names = [LEVELS[k] for k in chosen]
    R = np.stack([rotation_from_tilts(*row) for row in tilts[chosen]])
    flags = initial_tilt_flags(names, level_numbers(names), position[chosen], R, parameters)
    assert all(flag.code == "initial-tilts-doubtful" for flag in flags)
    return [flag.detail for flag in flags]


def test_no_sound_spine_is_refused_and_mistakes_are_seen() -> None:
    """Spines of 2 to 17 vertebrae; docs/flags.md has the shares of 3000 of each kind."""
    rng = np.random.default_rng(5)
    for parameters, max_flagged, min_signs in ((None, 0.005, 0.65), (MILD, 0.02, 0.0)):
        count = {"sound": 0, "radians refused": 0, "radians flagged": 0, "signs": 0}
        for seed in range(DRAWS):
            position, tilts = spine(seed, parameters)
            axes = rotation_from_vector(np.radians(rng.uniform(-10, 10, 3)))
            chosen = [int(k) for k in np.sort(rng.choice(17, rng.integers(2, 18), replace=False))]
            count["sound"] += bool(doubts(position @ axes.T, tilts, chosen))
            count["signs"] += bool(doubts(position, tilts * (-1, 1, 1), chosen))
            try:
                count["radians flagged"] += bool(doubts(position, np.radians(tilts), chosen))
            except InitialTiltsError:
                count["radians refused"] += 1
        assert count["sound"] <= max_flagged * DRAWS, count
        assert count["signs"] >= min_signs * DRAWS, count
        assert count["radians refused"] >= 0.7 * DRAWS, count
        assert count["radians refused"] + count["radians flagged"] >= 0.93 * DRAWS, count


@pytest.mark.parametrize(("seed", "levels"), list(product(range(6), [range(17), EVERY_OTHER])))
def test_radians_and_zeros_along_a_line_that_bends_are_refused(seed: int, levels: Sequence[int]) -> None:
    position, tilts = spine(seed)
    for wrong in (np.radians(tilts), np.zeros_like(tilts)):
        with pytest.raises(
            InitialTiltsError, match=r"below 1\.6 degrees.* bends by .* not in radians"
        ) as error:
            doubts(position, wrong, levels)
        assert "\n" not in str(error.value)
        assert error.value.code == "initial-tilts"


def test_radians_along_a_straight_line_are_flagged() -> None:
    straight = np.stack([np.zeros(17), np.zeros(17), -30.0 * np.arange(17)], axis=1)
    tilts = np.radians(np.linspace((-20, 10, 5), (25, 10, 5), 17))
    (detail,) = doubts(straight, tilts, EVERY_OTHER)
    assert "from T5 to L1 is below 1.6 degrees" in detail
    assert doubts(straight, tilts, (4, 5, 6)) == []
    assert doubts(straight, np.zeros((17, 3))) == []
    assert doubts(straight, np.full((17, 3), 1e-9)) == []


@pytest.mark.parametrize("seed", range(0, 18, 3))
def test_a_wrong_sign_and_exchanged_planes_are_flagged(seed: int) -> None:
    position, tilts = spine(seed, ScoliosisParameters(cobb_deg=(50.0, 70.0), kyphosis_deg=(15.0, 25.0)))
    detail = doubts(position, tilts * (-1, 1, 1))[0]
    assert detail.startswith("coronal tilts differ from the line of the centroids by")
    assert "check their signs and order" in detail
    assert doubts(position, tilts[:, [1, 0, 2]])


def test_a_common_tilt_of_line_and_axes_is_no_doubt() -> None:
    position, tilts = spine()
    lean = rotation_from_tilts(20.0, -15.0, 0.0)
    assert doubts(position @ lean.T, tilts) == []


def test_two_vertebrae_and_distant_ones_are_not_compared() -> None:
    position, tilts = spine()
    assert doubts(position, np.radians(tilts), (8, 9)) == []
    assert doubts(position, -tilts, (0, 8, 16)) == []


def test_parameters_are_used() -> None:
    position, tilts = spine()
    with pytest.raises(InitialTiltsError):
        doubts(position, np.radians(tilts))
    assert doubts(position, np.radians(tilts), parameters=InitialTiltParameters(max_bend_deg=180.0))
    strict = InitialTiltParameters(max_rms_deg=0.1, min_rms_ratio=0.1)
    assert len(doubts(position, tilts, parameters=strict)) == 2
