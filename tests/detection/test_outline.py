import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.outline import OutlineParameters, fit_outlines

BALL = (9.1, 10.8)
Float = NDArray[np.floating]


def ball_picture(
    centre: tuple[float, float], surroundings: Float | float, blur: float = 0.5, fine: int = 8
) -> Float:
    """Return a (31, 31) picture of a dark ellipse, integrated over pixels of ``fine`` x ``fine`` samples."""
    n = 31 * fine
    y, x = ((np.mgrid[:n, :n] + 0.5) / fine) - 0.5
    outside = np.hypot((x - centre[0]) / (BALL[0] / 2), (y - centre[1]) / (BALL[1] / 2)) > 1
    scene = np.where(outside, np.kron(np.broadcast_to(surroundings, (31, 31)), np.ones((fine, fine))), 20.0)
    k = np.arange(-4 * fine, 4 * fine + 1) / fine
    kernel = np.exp(-0.5 * (k / blur) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        scene = np.apply_along_axis(
            lambda line: np.convolve(np.pad(line, 4 * fine, "edge"), kernel, "valid"), axis, scene
        )
    return np.asarray(scene.reshape(31, fine, 31, fine).mean(axis=(1, 3)))


@settings(max_examples=15, deadline=None)
@given(st.floats(14.5, 15.5), st.floats(14.5, 15.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_ball_on_plain_ground_is_placed_to_a_fiftieth_of_a_pixel(
    u: float, v: float, du: float, dv: float
) -> None:
    picture = ball_picture((u, v), 150.0)
    found = fit_outlines(picture, np.array([[u + du, v + dv]]), BALL, OutlineParameters(iterations=8))
    assert np.abs(found.xy_px[0] - (u, v)).max() < 0.02
    assert found.contrast[0] == pytest.approx(130, rel=0.05)


def test_a_sloping_ground_and_a_bright_highlight_do_not_shift_the_outline() -> None:
    ground = np.tile(np.linspace(60, 200, 31), (31, 1))
    picture = ball_picture((15.2, 14.9), ground)
    picture[14:16, 16:18] += 120
    found = fit_outlines(picture, np.array([[15.0, 15.0]]), BALL, OutlineParameters(iterations=8))
    assert np.abs(found.xy_px[0] - (15.2, 14.9)).max() < 0.05


def test_the_covariance_tells_the_errors_on_textured_ground() -> None:
    rng = np.random.default_rng(0)
    truth, pictures = rng.uniform(14.5, 15.5, (40, 2)), []
    for centre in truth:
        blocks = np.kron(rng.uniform(60, 220, (11, 11)), np.ones((3, 3)))[:31, :31]
        pictures.append(ball_picture((centre[0], centre[1]), blocks, fine=4) + rng.normal(0, 2, (31, 31)))
    fits = [
        fit_outlines(p, np.round(t)[None], BALL, OutlineParameters())
        for p, t in zip(pictures, truth, strict=True)
    ]
    errors = np.array([f.xy_px[0] for f in fits]) - truth
    stated = np.array([f.covariance_px2[0].diagonal() for f in fits])
    assert np.abs(errors).max() < 0.6
    chi2_of_one = 0.455  # median
    assert 0.3 < np.median(errors**2 / stated) / chi2_of_one < 2.5


def test_no_features_give_no_outlines() -> None:
    assert fit_outlines(np.zeros((9, 9)), np.empty((0, 2)), BALL, OutlineParameters()).xy_px.shape == (0, 2)


def test_a_constant_picture_gives_finite_numbers_near_the_start() -> None:
    found = fit_outlines(np.full((30, 30), 90.0), np.array([[12.0, 12.0]]), BALL, OutlineParameters())
    assert np.abs(found.xy_px - 12).max() <= OutlineParameters().reach_px + 1e-6
    assert np.isfinite(found.covariance_px2).all()
