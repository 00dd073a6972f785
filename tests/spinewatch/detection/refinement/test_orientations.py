"""Estimates in several orientations, and their mean."""

import numpy as np
import pytest

from spinewatch.arrays import Single
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.orientations import (
    MIRRORED,
    ROTATED,
    UPRIGHT,
    PatchPredictor,
    Turn,
    mean_centres,
)
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.tone import patch_tone
from tests.paths import SAMPLES

BALL_PX = np.array([9.1, 10.8])


@pytest.fixture(scope="module")
def tone() -> Single:
    image = decode_image((SAMPLES / "D1" / "PRE" / "left.png").read_bytes())
    return patch_tone(Frame(image, "left").gray())


def predictor(tone: Single, max_shift: float = 0.7) -> PatchPredictor:
    lighting = Lighting.expected(np.array([0.25, 0.0]))
    return PatchPredictor(default_networks().proposal, tone, BALL_PX, lighting, max_shift)


@pytest.mark.parametrize("turn", [UPRIGHT, ROTATED, MIRRORED])
def test_a_turned_image_has_its_centres_at_the_turned_places(tone: Single, turn: Turn) -> None:
    height, width = tone.shape
    u, v = turn
    of_image = predictor(tone)
    turned = PatchPredictor(
        of_image.network,
        np.ascontiguousarray(tone[::v, ::u]),
        BALL_PX,
        of_image.lighting.turned(turn),
        of_image.max_shift,
    )
    places = np.array([[200.0, 150.0], [310.0, 222.0]])
    size = np.array([width, height])
    turned_places = np.where(np.array(turn) > 0, places, size - 1 - places)
    _, centre = of_image.at(places, turn)
    _, turned_centre = turned.at(turned_places)
    assert np.where(np.array(turn) > 0, turned_centre, size - 1 - turned_centre) == pytest.approx(
        centre, abs=1e-3
    )


def test_a_centre_stays_within_the_greatest_shift_of_the_middle_of_its_patch(tone: Single) -> None:
    places = np.random.default_rng(1).uniform(50, 350, (40, 2))
    _, centre = predictor(tone, max_shift=0.1).at(places)
    shift = np.abs(centre - np.rint(places)) / (BALL_PX / 2)
    assert shift.max() == pytest.approx(0.1)


def test_the_mean_of_independent_errors_has_the_variance_of_one_over_their_number() -> None:
    rng = np.random.default_rng(2)
    centres = [rng.normal(size=(5, 2)) for _ in range(3)]
    covariances = [np.tile(np.diag([k, 1.0]), (5, 1, 1)) for k in (1.0, 2.0, 3.0)]
    mean = mean_centres(centres, covariances, 0.0)
    assert mean.centre == pytest.approx(sum(centres) / 3)
    assert mean.of_one == pytest.approx(np.tile(np.diag([2.0, 1.0]), (5, 1, 1)))
    assert mean.covariance == pytest.approx(mean.of_one / 3)


def test_equal_errors_are_no_less_in_their_mean() -> None:
    mean = mean_centres([np.zeros((2, 2))] * 4, [np.tile(np.eye(2), (2, 1, 1))] * 4, 1.0)
    assert mean.covariance == pytest.approx(mean.of_one)


def test_one_orientation_is_its_own_mean() -> None:
    centre, covariance = np.array([[1.0, 2.0]]), np.eye(2)[None]
    mean = mean_centres([centre], [covariance], 0.8)
    assert np.array_equal(mean.centre, centre)
    assert np.array_equal(mean.covariance, covariance)
