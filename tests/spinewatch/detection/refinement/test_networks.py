"""The network: what its file holds, and what it says about simulated balls that it has not seen."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from spinewatch.detection.refinement.networks import (
    UNITS,
    BallEstimates,
    default_ball_nets,
    look,
    read_ball_nets,
    write_ball_nets,
)
from spinewatch.errors import BallNetError
from spinewatch.simulation.images.examples import ExampleParameters, Examples, draw_examples


@pytest.fixture(scope="module", params=[10.0, 30.0])
def seen(request: pytest.FixtureRequest) -> tuple[Examples, BallEstimates]:
    net = default_ball_nets().judge(request.param)
    width = (0.9 * request.param, 1.1 * request.param)
    examples = draw_examples(np.random.default_rng(7), 400, ExampleParameters(net.grid, width, width[1]))
    parts = [
        look(net, patch[None].astype(np.float32), up, known=False)
        for patch, up in zip(examples.patches, examples.up, strict=True)
    ]
    joined = (np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0]))
    return examples, BallEstimates(*joined)


def clear(examples: Examples) -> NDArray[np.bool_]:
    return examples.ball & (examples.visible > 0.9)


def test_balls_are_told_from_other_things(seen: tuple[Examples, BallEstimates]) -> None:
    examples, sightings = seen
    assert np.mean((sightings.log_odds > 0) == examples.ball) > 0.88


def test_centres_are_a_fiftieth_of_a_radius_off_and_their_covariance_says_so(
    seen: tuple[Examples, BallEstimates],
) -> None:
    examples, sightings = seen
    error = (examples.offset - sightings.offset)[clear(examples)]
    assert np.median(np.abs(error)) < 0.022
    chi2 = np.einsum("ni,nij,nj->n", error, np.linalg.inv(sightings.covariance[clear(examples)]), error)
    # Errors follow Student's t in two dimensions, of as many degrees of freedom as they were weighed by in training.
    freedom = UNITS["freedom"]
    wanted = 2 * stats.f(2, freedom).median() * (freedom - 2) / freedom
    assert np.median(chi2) == pytest.approx(wanted, rel=0.3)


def test_sizes_and_hidden_parts_are_seen(seen: tuple[Examples, BallEstimates]) -> None:
    examples, sightings = seen
    size = (examples.log_size - sightings.log_size)[clear(examples)]
    assert np.median(np.abs(size)) < 0.03
    visible = sightings.visible[examples.ball]
    assert np.corrcoef(visible, examples.visible[examples.ball])[0, 1] > 0.4


def test_the_lamp_is_found_better_than_told(seen: tuple[Examples, BallEstimates]) -> None:
    examples, sightings = seen
    found = np.linalg.norm(examples.lamp - sightings.lamp, axis=1)[clear(examples)]
    told = np.linalg.norm(examples.lamp - examples.up, axis=1)[clear(examples)]
    assert np.median(found) < 0.95 * np.median(told)


def test_a_file_of_networks_is_read_as_it_was_written() -> None:
    nets = default_ball_nets()
    again = read_ball_nets(write_ball_nets(nets))
    assert len(write_ball_nets(nets)) < 2_000_000
    assert len(again.judges) == len(nets.judges)
    for net, copy in zip((nets.scout, *nets.judges), (again.scout, *again.judges), strict=True):
        assert (copy.grid, copy.from_px) == (net.grid, net.from_px)
        for layer, other in zip(net.layers, copy.layers, strict=True):
            assert np.array_equal(layer.weights, other.weights)
            assert (layer.lamp is None) == (other.lamp is None)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a file of weights"])
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(BallNetError, match="no ball network"):
        read_ball_nets(data)


def test_each_width_has_its_network() -> None:
    nets = default_ball_nets()
    assert [nets.judge(width).grid.size for width in (0.5, 9.0, 40.0)] == [25, 25, 49]
