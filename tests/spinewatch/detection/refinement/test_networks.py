"""The networks' estimates of simulated balls that were not in the training set."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import (
    SCALES,
    BallEstimates,
    normalize,
    predict_balls,
    predict_turned,
)
from spinewatch.simulation.images.examples import Examples, random_examples
from spinewatch.simulation.images.shots import ExampleParameters

LIGHT = Lighting.measured(np.array([0.3, 0.1]), 4.0)


@pytest.fixture(scope="module", params=[10.0, 30.0])
def predicted(request: pytest.FixtureRequest) -> tuple[Examples, BallEstimates]:
    network, *_ = default_networks().refinement_networks(request.param)
    width = (0.9 * request.param, 1.1 * request.param)
    examples = random_examples(
        np.random.default_rng(7), 1200, ExampleParameters(network.grid, width, width[1])
    )
    parts = [
        predict_balls(network, patch[None].astype(np.float32), Lighting.expected(up))
        for patch, up in zip(examples.patches, examples.up, strict=True)
    ]
    joined = (np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0]))
    return examples, BallEstimates(*joined)


def clear(examples: Examples) -> NDArray[np.bool_]:
    return examples.ball & (examples.visible > 0.9)


def test_balls_are_distinguished_from_other_things(predicted: tuple[Examples, BallEstimates]) -> None:
    examples, estimates = predicted
    assert np.mean((estimates.log_odds > 0) == examples.ball) > 0.88


def test_centres_are_a_fiftieth_of_a_radius_off_and_their_covariance_agrees(
    predicted: tuple[Examples, BallEstimates],
) -> None:
    examples, estimates = predicted
    error = (examples.offset - estimates.offset)[clear(examples)]
    assert np.median(np.abs(error)) < 0.022
    chi2 = np.einsum("ni,nij,nj->n", error, np.linalg.inv(estimates.covariance[clear(examples)]), error)
    # Errors follow Student's t in two dimensions, of as many degrees of dof as the likelihood of training has.
    dof = SCALES.dof
    wanted = 2 * stats.f(2, dof).median() * (dof - 2) / dof
    assert np.median(chi2) == pytest.approx(wanted, rel=0.3)


def test_sizes_and_hidden_parts_are_estimated(predicted: tuple[Examples, BallEstimates]) -> None:
    examples, estimates = predicted
    size = (examples.log_size - estimates.log_size)[clear(examples)]
    assert np.median(np.abs(size)) < 0.03
    balls = examples.ball
    assert np.corrcoef(estimates.visible[balls], examples.visible[balls])[0, 1] > 0.4


def test_the_lamp_is_estimated_better_than_expected(predicted: tuple[Examples, BallEstimates]) -> None:
    examples, estimates = predicted
    found = np.linalg.norm(examples.lamp - estimates.lamp, axis=1)[clear(examples)]
    expected = np.linalg.norm(examples.lamp - examples.up, axis=1)[clear(examples)]
    assert np.median(found) < 0.95 * np.median(expected)


def test_each_width_of_ball_has_its_network() -> None:
    networks = default_networks()
    assert [networks.refinement_networks(width)[0].grid.size for width in (0.5, 9.0, 40.0)] == [25, 25, 49]


def test_patches_have_unit_contrast_except_faint_ones() -> None:
    noise = np.random.default_rng(0).normal(3, 1, (2, 25, 25)).astype(np.float32)
    noise[1] *= 1e-4
    strong, faint = normalize(noise)
    assert (strong.mean(), strong.std()) == pytest.approx((0, 1), abs=0.06)
    assert faint.std() < 0.01


def test_patches_are_estimated_one_by_one_as_in_a_batch() -> None:
    network = default_networks().proposal
    patches = np.random.default_rng(0).normal(0, 1, (300, 25, 25)).astype(np.float32)
    batch = predict_balls(network, patches, LIGHT)
    alone = predict_balls(network, patches[280:281], LIGHT)
    assert batch.log_odds[280] == pytest.approx(alone.log_odds[0], abs=1e-4)
    assert len(predict_balls(network, patches[:0], LIGHT).log_odds) == 0


@pytest.mark.parametrize("turn", [(-1, -1), (-1, 1), (1, -1)])
def test_estimates_of_turned_patches_are_turned_back(turn: tuple[int, int]) -> None:
    network, *_ = default_networks().refinement_networks(10.0)
    patches = np.random.default_rng(2).normal(size=(4, 25, 25)).astype(np.float32)
    u, v = sign = np.array(turn)
    upright = predict_balls(network, patches, LIGHT)
    again = predict_turned(network, patches[:, ::v, ::u], LIGHT.turned(turn), turn)
    assert again.offset == pytest.approx(sign * upright.offset)
    assert again.covariance == pytest.approx(np.outer(sign, sign) * upright.covariance)
    assert again.lamp == pytest.approx(sign * upright.lamp)
    assert again.log_odds == pytest.approx(upright.log_odds)


def test_covariances_in_the_image_are_those_of_a_ball_of_that_size_and_probable_balls_exceed_the_odds() -> (
    None
):
    network, *_ = default_networks().refinement_networks(10.0)
    seen = predict_balls(network, np.random.default_rng(3).normal(size=(4, 25, 25)).astype(np.float32), LIGHT)
    covariance = seen.covariance_px2(np.array([8.0, 10.0]))
    assert covariance[:, 0, 0] == pytest.approx(16 * seen.covariance[:, 0, 0])
    assert covariance[:, 0, 1] == pytest.approx(20 * seen.covariance[:, 0, 1])
    assert covariance[:, 1, 1] == pytest.approx(25 * seen.covariance[:, 1, 1])
    odds = np.exp(seen.log_odds)
    assert np.array_equal(seen.probable(float(np.median(odds))), odds > np.median(odds))


def test_odds_and_the_errors_that_a_view_shares_are_better_where_the_other_balls_are_known() -> None:
    network, *_ = default_networks().refinement_networks(10.0)
    parameters = ExampleParameters(network.grid, (8.0, 12.0), wider=12.0)
    examples = random_examples(np.random.default_rng(8), 1600, parameters)
    losses, shared_errors = [], []
    for known in (clear(examples), np.zeros(1600, dtype=bool)):
        log_odds, shared = [], []
        for image in range(examples.image.max() + 1):
            of_image = examples.image == image
            patches = examples.patches[of_image].astype(np.float32)
            lighting = Lighting.expected(examples.up[of_image][0].astype(float))
            seen = predict_balls(network, patches, lighting, known[of_image])
            log_odds.append(seen.log_odds)
            balls = clear(examples)[of_image]
            if balls.sum() >= 4:
                shared.append(np.median((examples.offset[of_image] - seen.offset)[balls], axis=0))
        of_all = np.concatenate(log_odds)
        losses.append(np.mean(np.logaddexp(0, of_all) - examples.ball * of_all))
        shared_errors.append(np.sqrt(np.mean(np.square(shared))))
    assert losses[0] < 0.985 * losses[1]
    assert shared_errors[0] < 0.98 * shared_errors[1]


def test_the_mean_of_the_other_balls_is_turned_with_the_patches() -> None:
    network, *_ = default_networks().refinement_networks(10.0)
    patches = np.random.default_rng(5).normal(size=(6, 25, 25)).astype(np.float32)
    is_ball = np.array([True, True, False, True, True, True])
    upright = predict_balls(network, patches, LIGHT, is_ball)
    again = predict_turned(network, patches[:, ::-1, ::-1], LIGHT.turned((-1, -1)), (-1, -1), is_ball)
    assert again.offset == pytest.approx(-upright.offset, abs=1e-5)
    alone = predict_balls(network, patches, LIGHT)
    assert not np.allclose(alone.offset, upright.offset, atol=1e-3)


def test_balls_in_view_are_probable_and_mostly_visible() -> None:
    seen = predict_balls(
        default_networks().proposal,
        np.random.default_rng(6).normal(size=(50, 25, 25)).astype(np.float32),
        LIGHT,
    )
    odds = float(np.exp(np.median(seen.log_odds)))
    assert np.array_equal(seen.in_view(odds), seen.probable(odds) & (seen.visible > 0.5))
