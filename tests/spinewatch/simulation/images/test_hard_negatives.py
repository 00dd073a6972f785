import numpy as np

from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import predict_balls
from spinewatch.detection.refinement.patches import cut_patches
from spinewatch.imaging.tone import patch_tone
from spinewatch.simulation.images.hard_negatives import hard_negative
from spinewatch.simulation.images.random_worlds import random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import SensorModel, expose, random_sensor
from spinewatch.simulation.images.textures import random_textures
from spinewatch.simulation.images.world import World

BALL_PX = np.array([9.0, 10.6])
NETWORK = default_networks().proposal


def _log_odds(world: World, x: float, y: float, rng: np.random.Generator) -> float:
    """Return the log-odds of a ball at a place of a world, in an image by a random sensor."""
    half = np.ceil(4 * BALL_PX / 2).astype(int)
    across, down = ((np.arange(2 * n + 1) - n) / (size / 2) for n, size in zip(half, BALL_PX, strict=True))
    u, v = np.meshgrid((across + x).astype(np.float32), (y - down).astype(np.float32))
    radiance, _ = trace(world, u, v)
    tone = patch_tone(expose(radiance, 1, random_sensor(rng, (9.0, 10.6)), rng))
    patch = cut_patches(tone, half[None], (9.0, 10.6), NETWORK.grid)
    light = Lighting.expected(world.up[:2].astype(np.float64) * (1, -1))
    return float(predict_balls(NETWORK, patch, light).log_odds[0])


def test_odds_are_higher_than_those_of_places_at_random() -> None:
    rng = np.random.default_rng(1)
    textures = random_textures(rng, 8, 64)

    def draw_world() -> World:
        return random_world(rng, textures, present=False)

    def draw_sensor() -> SensorModel:
        return random_sensor(rng, (9.0, 10.6))

    hard, any_place = [], []
    for _ in range(25):
        world, (x, y) = hard_negative(NETWORK, BALL_PX, draw_world, draw_sensor, rng)
        hard.append(_log_odds(world, x, y, rng))
        any_place.append(_log_odds(draw_world(), 0.0, 0.0, rng))
    assert np.median(hard) > np.median(any_place) + 1


def test_no_ball_is_near_the_place() -> None:
    rng = np.random.default_rng(2)
    textures = random_textures(rng, 8, 64)
    for _ in range(25):
        world, place = hard_negative(
            NETWORK,
            BALL_PX,
            lambda: random_world(rng, textures, present=False),
            lambda: random_sensor(rng, (9.0, 10.6)),
            rng,
        )
        assert not world.present
        if place.any():
            balls = [sphere.centre[:2] for sphere in world.spheres if sphere.radius == 1.0]
            assert all(np.linalg.norm(place - ball) > 1 for ball in balls)
