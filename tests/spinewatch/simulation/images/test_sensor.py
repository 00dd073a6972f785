import numpy as np
import pytest

from spinewatch.simulation.images.sensor import SensorModel, expose, random_sensor


def test_the_median_radiance_gets_its_level_and_noise() -> None:
    radiance = np.full((400, 400), 0.3, np.float32)
    sensor = SensorModel((0.5, 0.5), 100.0, 0.0, 0.0, 2.0, 0.05, 1.0)
    levels = expose(radiance, 4, sensor, np.random.default_rng(1))
    assert levels.shape == (100, 100)
    assert levels.mean() == pytest.approx(100, abs=0.2)
    assert levels.std() == pytest.approx(np.sqrt(4 + 5 + 1 / 12), rel=0.05)


def test_blur_has_its_standard_deviation() -> None:
    radiance = np.ones((41 * 4, 41 * 4), np.float32)
    radiance[80:84, 80:84] = 100
    sensor = SensorModel((1.5, 0.8), 20.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    image = expose(radiance, 4, sensor, np.random.default_rng(0)) - 20
    u, v = np.meshgrid(np.arange(41) - 20, np.arange(41) - 20)
    for offset, sd in ((u, 1.5), (v, 0.8)):
        variance = (image * offset**2).sum() / image.sum()
        assert np.sqrt(variance) == pytest.approx(np.hypot(sd, np.sqrt(1 / 12)), rel=0.1)


def test_the_tone_curve_saturates_and_veil_and_black_raise_the_level() -> None:
    even = np.full((8, 8), 2.0, np.float32)
    rng = np.random.default_rng(0)

    def level(**changes: float) -> float:
        values = {"level": 100.0, "veil": 0.0, "black": 0.0, "read": 0.0, "shot": 0.0, "response": 1.0}
        return float(expose(even, 2, SensorModel((0.5, 0.5), **(values | changes)), rng)[0, 0])

    assert level() == 100
    assert level(veil=0.1, black=5.0) == 115
    assert level(level=400.0) == 255
    assert level(response=0.5) == round(255 * (100 / 255) ** 0.5)


def test_random_sensors_are_within_their_ranges() -> None:
    rng = np.random.default_rng(0)
    sensors = [random_sensor(rng) for _ in range(300)]
    assert all(0 < sensor.read < 2 and 0 <= sensor.veil <= 0.08 for sensor in sensors)
    assert all(5 <= sensor.level <= 350 for sensor in sensors)
    assert any(sensor.response < 1 for sensor in sensors)
