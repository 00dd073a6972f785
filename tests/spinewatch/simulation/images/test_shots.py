from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Single
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.families import FAMILIES, UNUSUAL, families_of_sensor
from spinewatch.simulation.images.shots import N_TRUTH, ExampleParameters, exposed, random_shot, random_view
from spinewatch.simulation.images.textures import random_textures

PARAMETERS = ExampleParameters(PatchGrid(25, 5.0), (8.0, 12.0), wider=20.0, present=1.0)


@pytest.fixture(scope="module")
def textures() -> Single:
    return random_textures(np.random.default_rng(1), 4, 64)


def test_the_shots_of_a_view_have_balls_of_about_its_size(textures: Single) -> None:
    rng = np.random.default_rng(2)
    view = random_view(rng, textures, 2, PARAMETERS)
    shots = [random_shot(rng, textures, view, PARAMETERS) for _ in range(12)]
    ratio = np.array([shot.ball_px / view.ball_px for shot in shots])
    assert np.ptp(ratio[:, 0]) > 0.01
    assert np.abs(np.log(ratio)).max() < 0.15
    for shot in shots:
        assert shot.world.present
        assert shot.radiance.shape == tuple((2 * shot.half[::-1] + 1) * shot.samples)


def test_an_exposure_has_a_patch_and_its_truth(textures: Single) -> None:
    rng = np.random.default_rng(3)
    view = random_view(rng, textures, 2, PARAMETERS)
    shot = random_shot(rng, textures, view, PARAMETERS)
    patch, truth = exposed(rng, shot, view.sensors[1], PARAMETERS.grid)
    assert patch.shape == (25, 25)
    assert truth.shape == (N_TRUTH,)
    assert truth[3] == pytest.approx(shot.visible)
    of_sensor = families_of_sensor(view.sensors[1])
    stated = dict(zip(FAMILIES, truth[10:], strict=True))
    assert all(stated[name] == yes for name, yes in of_sensor.items())


def test_a_view_without_some_families_has_worlds_and_sensors_of_none_of_them(textures: Single) -> None:
    rng = np.random.default_rng(4)
    usual = replace(PARAMETERS, left_out=UNUSUAL)
    for _ in range(10):
        view = random_view(rng, textures, 2, usual)
        for sensor in view.sensors:
            shot = random_shot(rng, textures, view, usual)
            truth = dict(zip(FAMILIES, exposed(rng, shot, sensor, usual.grid)[1][10:], strict=True))
            assert not any(truth[name] for name in UNUSUAL)
