from dataclasses import replace

import numpy as np
import pytest

from spinewatch.calibration.errors import PoorFitError
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.blunders import BlunderParameters, adjust_without_blunders
from spinewatch.calibration.solve.bundle import adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES
from tests.spinewatch.calibration.simulated import FIELD, WIDE, image, one_camera, parameter_error

FREE = (*EXTERIOR_NAMES, "f", "x0", "y0", "K1")
PARAMETERS = BlunderParameters()


def points(seed: int, offsets: dict[int, tuple[float, float]], sigma_px: float = 0.2) -> ImagePoints:
    offsets_px = np.zeros((30, 2))
    for i, offset in offsets.items():
        offsets_px[i] = offset
    return image(WIDE.left, FIELD.ids, sigma_px=sigma_px, seed=seed, offsets_px=offsets_px)


def removed(measured: ImagePoints, parameters: BlunderParameters = PARAMETERS) -> set[str]:
    _, blunders = adjust_without_blunders(one_camera(WIDE.left, measured, FREE), parameters)
    return {b.id for b in blunders}


def test_three_blunders_of_several_sigma_are_found_and_good_points_stay() -> None:
    offsets = {3: (1.6, 0.0), 14: (-1.2, 1.2), 21: (0.0, -1.7)}
    for seed in range(4):
        assert not removed(points(seed, {}))
        assert removed(points(seed, offsets)) == {"4", "15", "22"}


def test_large_blunders_do_not_mask_each_other() -> None:
    offsets = {2: (30.0, -25.0), 9: (-40.0, 10.0), 16: (0.0, 35.0), 27: (-20.0, -20.0)}
    assert removed(points(0, offsets)) == {"3", "10", "17", "28"}


def test_a_blunder_is_described_by_its_distance_from_the_prediction() -> None:
    block = one_camera(WIDE.left, points(0, {9: (6.0, 8.0)}, 0.02), FREE)
    adjustment, (blunder,) = adjust_without_blunders(block, PARAMETERS)
    assert (blunder.camera, blunder.shot, blunder.id) == (0, 0, "10")
    assert blunder.residual_px == pytest.approx(10.0, abs=0.2)
    assert "10" not in adjustment.block.images[0, 0].ids
    assert parameter_error(adjustment.block.cameras[0], WIDE.left) < 5 * max(adjustment.sd.values())


def test_sound_calibrations_lose_points_as_often_as_the_significance_states() -> None:
    lost = [bool(removed(points(seed, {}), replace(PARAMETERS, significance=0.3))) for seed in range(40)]
    assert 0.1 < np.mean(lost) < 0.55


def test_residuals_below_the_floor_are_not_suspicious() -> None:
    offsets = {5: (0.04, 0.0)}
    assert not removed(points(0, offsets, 0.001))
    assert removed(points(0, offsets, 0.001), replace(PARAMETERS, floor_px=0.002)) == {"6"}


def test_without_the_test_or_without_redundancy_nothing_is_removed() -> None:
    assert not removed(points(0, {3: (9.0, 9.0)}), replace(PARAMETERS, enabled=False))
    few = one_camera(WIDE.left, points(0, {}).keep(np.arange(30) < 6), FREE)
    assert not adjust_without_blunders(few, PARAMETERS)[1]


def test_more_blunders_than_permitted_are_refused() -> None:
    offsets = {2: (30.0, -25.0), 9: (-40.0, 10.0)}
    with pytest.raises(PoorFitError, match="2 of 30 points contradict the others"):
        removed(points(0, offsets), replace(PARAMETERS, max_fraction=0.05))
    with pytest.raises(PoorFitError, match="2 of 30"):
        removed(points(0, offsets), replace(PARAMETERS, min_kept=29))


def test_weights_scale_the_test() -> None:
    measured = points(0, {9: (2.0, 0.0)})
    sd = np.where(np.arange(30) == 9, 10.0, 1.0)
    uncertain = ImagePoints.build(measured.ids, measured.control_mm, measured.pixels, sd)
    assert removed(measured) == {"10"}
    assert not removed(uncertain)
    assert adjust(one_camera(WIDE.left, uncertain, FREE)).sigma0 == pytest.approx(0.2, rel=0.3)
