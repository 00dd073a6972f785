from dataclasses import replace

import cv2
import numpy as np
import pytest

from spinewatch.arrays import Floating
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

    plain = SensorModel((0.5, 0.5), 100.0, 0.0, 0.0, 0.0, 0.0, 1.0)

    def level(sensor: SensorModel) -> float:
        return float(expose(even, 2, sensor, rng)[0, 0])

    assert level(plain) == 100
    assert level(replace(plain, veil=0.1, black=5.0)) == 115
    assert level(replace(plain, level=400.0)) == 255
    assert level(replace(plain, response=0.5)) == round(255 * (100 / 255) ** 0.5)


def test_random_sensors_are_within_their_ranges() -> None:
    rng = np.random.default_rng(0)
    sensors = [random_sensor(rng, (10.0, 11.8)) for _ in range(300)]
    assert all(0 < sensor.read < 7 and 0 <= sensor.veil <= 0.08 for sensor in sensors)
    assert all(5 <= sensor.level <= 350 for sensor in sensors)
    assert any(sensor.response < 1 for sensor in sensors)
    assert all(max(sensor.defocus_px) < 5 and np.hypot(*sensor.motion_px) < 5.4 for sensor in sensors)
    assert 0.2 < np.mean([sensor.quality is not None for sensor in sensors]) < 0.5


def spread(sensor: SensorModel) -> tuple[Floating, Floating]:
    """Return mean and covariance of the image of a point, px."""
    radiance = np.ones((41 * 4, 41 * 4), np.float32)
    radiance[80:84, 80:84] = 100
    image = expose(radiance, 4, sensor, np.random.default_rng(0)).astype(float)
    weight = (image - np.median(image)).ravel()
    u, v = np.meshgrid(np.arange(41) - 20, np.arange(41) - 20)
    positions = np.stack([u.ravel(), v.ravel()], axis=1)
    mean = weight @ positions / weight.sum()
    return mean, np.einsum("n,ni,nj->ij", weight, positions - mean, positions - mean) / weight.sum()


SHARP = SensorModel((0.5, 0.5), 20.0, 0.0, 0.0, 0.0, 0.0, 1.0)
SHARP_VARIANCE = 0.5**2 + 1 / 12


def test_defocus_is_a_disc_about_the_middle() -> None:
    mean, covariance = spread(replace(SHARP, defocus_px=(6.0, 4.0)))
    assert mean == pytest.approx([0, 0], abs=0.02)
    expected = np.diag([6.0**2 / 16 + SHARP_VARIANCE, 4.0**2 / 16 + SHARP_VARIANCE])
    assert covariance == pytest.approx(expected, rel=0.1, abs=0.05)


def test_movement_blurs_along_its_direction_only() -> None:
    mean, covariance = spread(replace(SHARP, motion_px=(3.0, -3.0)))
    assert mean == pytest.approx([0, 0], abs=0.02)
    along = 9 / 12
    expected = SHARP_VARIANCE * np.eye(2) + along * np.array([[1, -1], [-1, 1]])
    assert covariance == pytest.approx(expected, rel=0.15, abs=0.05)


def test_compression_changes_levels_little_at_high_quality_and_adds_blocks_at_low_quality() -> None:
    rng = np.random.default_rng(0)
    radiance = np.exp(cv2.GaussianBlur(rng.standard_normal((120, 160)).astype(np.float32), (0, 0), 4) * 3)
    plain = expose(radiance, 2, SHARP, np.random.default_rng(1))
    fine, coarse = (
        expose(radiance, 2, replace(SHARP, quality=quality), np.random.default_rng(1)) for quality in (97, 25)
    )
    assert plain.shape == fine.shape == coarse.shape == (60, 80)
    assert np.abs(fine - plain).max() <= 3
    assert np.abs(coarse - plain).mean() > 3 * np.abs(fine - plain).mean()


def test_vignetting_darkens_one_side_and_sharpening_steepens_edges() -> None:
    even = np.ones((40, 40), np.float32)
    rng = np.random.default_rng(0)
    bright = replace(SHARP, level=100.0)
    shaded = expose(even, 2, replace(bright, vignette=(0.1, 0.0)), rng)
    assert shaded[0, -1] / shaded[0, 0] == pytest.approx(np.exp(0.2), rel=0.02)
    step = np.where(np.arange(80) < 40, 1.0, 2.0).astype(np.float32)[None].repeat(80, axis=0)
    soft, sharp = (expose(step, 2, replace(bright, sharpening=a), rng)[20] for a in (0.0, 1.0))
    assert np.abs(np.diff(sharp)).max() > 1.3 * np.abs(np.diff(soft)).max()
