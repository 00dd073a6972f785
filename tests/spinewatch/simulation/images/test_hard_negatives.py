import numpy as np

from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.simulation.images.hard_negatives import hard_negative
from spinewatch.simulation.images.random_worlds import random_setting, random_world
from spinewatch.simulation.images.sensor import random_sensor
from spinewatch.simulation.images.textures import random_textures

BALL_PX = np.array([9.0, 10.6])


def test_no_ball_is_near_the_place() -> None:
    rng = np.random.default_rng(2)
    textures = random_textures(rng, 8, 64)
    beside_balls = 0
    for _ in range(25):
        world, place = hard_negative(
            default_networks().proposal,
            BALL_PX,
            lambda: random_world(rng, textures, random_setting(rng, textures), present=False),
            random_sensor(rng, (9.0, 10.6)),
            rng,
        )
        assert not world.present
        balls = [sphere.centre[:2] for sphere in world.spheres if sphere.radius == 1.0]
        assert all(np.linalg.norm(place - ball) > 1.2 for ball in balls)
        beside_balls += any(np.linalg.norm(ball) < 3 for ball in balls)
    assert beside_balls > 5
