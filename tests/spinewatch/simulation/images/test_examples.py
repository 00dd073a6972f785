from dataclasses import replace

import numpy as np

from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import predict_balls
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import Examples, random_examples
from spinewatch.simulation.images.families import FAMILIES, UNUSUAL
from spinewatch.simulation.images.shots import ExampleParameters

PARAMETERS = ExampleParameters(PatchGrid(25, 5.0), (8.0, 12.0), wider=20.0)


def test_the_same_seed_gives_the_same_examples() -> None:
    one, again = (random_examples(np.random.default_rng(5), 12, PARAMETERS) for _ in range(2))
    for name, values in vars(one).items():
        assert np.array_equal(values, getattr(again, name))
    assert one.patches.shape == (12, 25, 25)
    assert np.isfinite(one.patches).all()
    assert 0 < one.ball.sum() < 12


def test_the_truth_is_within_its_ranges() -> None:
    examples = random_examples(np.random.default_rng(6), 150, PARAMETERS)
    assert 0.5 < examples.ball.mean() < 0.9
    assert np.hypot(*examples.offset[examples.ball].T).max() < 0.5
    assert np.all((examples.visible >= 0) & (examples.visible <= 1.05))
    assert np.abs(examples.log_size).max() < 0.6
    assert np.hypot(*examples.up.T).max() <= 1
    assert np.median(np.linalg.norm(examples.up - examples.lamp, axis=1)) < 0.2


def test_balls_are_darker_than_bright_surroundings_at_the_stated_centre() -> None:
    examples = random_examples(np.random.default_rng(7), 150, PARAMETERS)
    dark, smeared = (examples.families[:, FAMILIES.index(name)] for name in ("dark tissue", "smeared"))
    whole = examples.ball & (examples.visible > 0.95) & ~dark & ~smeared
    grid = PARAMETERS.grid
    axis = (np.arange(grid.size) - (grid.size - 1) / 2) / grid.radius
    u, v = np.meshgrid(axis, axis)
    darker = []
    for patch, (du, dv) in zip(examples.patches[whole].astype(float), examples.offset[whole], strict=True):
        r = np.hypot(u - du, v - dv)
        darker.append(np.median(patch[r < 0.7]) < np.median(patch[(r > 1.3) & (r < 2)]))
    assert np.mean(darker) > 0.9


def test_families_are_of_the_stated_looks() -> None:
    examples = random_examples(np.random.default_rng(8), 640, PARAMETERS)
    family = dict(zip(FAMILIES, examples.families.T, strict=True))
    gloss = sum(family[name].astype(int) for name in ("glossy", "satin", "matte"))
    assert np.all(gloss[examples.ball] == 1)
    assert np.all(gloss <= 1)
    assert all(0 < members.sum() < 400 for members in family.values())


def test_no_example_belongs_to_a_family_that_is_left_out() -> None:
    left_out = tuple(name for name in FAMILIES if name != "glossy")
    usual = replace(PARAMETERS, left_out=left_out)
    examples = random_examples(np.random.default_rng(9), 60, usual)
    family = dict(zip(FAMILIES, examples.families.T, strict=True))
    assert not any(family[name].any() for name in left_out)
    assert np.all(family["glossy"][examples.ball])
    assert 0 < examples.ball.sum() < 60


def test_places_without_a_ball_deceive_a_network_more_if_it_finds_them() -> None:
    network = default_networks().proposal
    half = replace(PARAMETERS, present=0.5)
    odds = []
    for parameters in (half, replace(half, hard_for=network)):
        examples = random_examples(np.random.default_rng(10), 60, parameters)
        negatives = examples.patches[~examples.ball].astype(np.float32)
        odds.append(predict_balls(network, negatives, Lighting.expected(np.zeros(2))).log_odds)
    assert np.median(odds[1]) > np.median(odds[0]) + 0.5


def test_selections_together_are_all_examples() -> None:
    n = 240
    examples = random_examples(np.random.default_rng(8), n, PARAMETERS)
    usual = examples.without(UNUSUAL)
    assert 0 < len(usual.ball) < n
    assert not usual.families[:, [FAMILIES.index(name) for name in UNUSUAL]].any()
    first, rest = examples.take(np.arange(16)), examples.take(np.arange(n) >= 16)
    both = Examples.concatenate([first, replace(rest, image=rest.image - 2)])
    for name, values in vars(examples).items():
        assert np.array_equal(getattr(both, name), values)


def test_examples_of_an_image_share_its_light_and_sensor() -> None:
    examples = random_examples(np.random.default_rng(11), 96, PARAMETERS)
    assert np.array_equal(examples.image, np.arange(96) // 8)
    of_sensor = [FAMILIES.index(name) for name in ("defocused", "shaken", "compressed", "sharpened", "noisy")]
    for image in range(12):
        same = examples.image == image
        assert np.unique(examples.up[same], axis=0).shape == (1, 2)
        assert np.ptp(examples.lamp[same], axis=0).max() < 0.3
        assert np.unique(examples.families[same][:, of_sensor], axis=0).shape[0] == 1
