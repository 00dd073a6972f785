import numpy as np
import pytest

from spinewatch.detection.candidates.whitening import WhiteningParameters, clutter_covariance, whiten


def test_whitening_removes_from_a_template_what_clutter_looks_like() -> None:
    mask = np.ones((5, 5))
    stripes = np.tile(np.sin(np.arange(5)), (5, 1))[None, None]
    dot = np.zeros((1, 1, 5, 5))
    dot[0, 0, 2, 2] = 1.0
    clutter = np.outer(stripes.ravel(), stripes.ravel())
    (white,) = whiten(dot + stripes, mask, clutter, ridge=0.01)
    assert abs(np.sum(white * stripes)) < 0.2 * abs(np.sum((dot + stripes) * stripes)) / np.linalg.norm(
        dot + stripes
    )
    assert np.linalg.norm(white) == pytest.approx(1)


def test_clutter_covariance_is_that_of_patches_at_random() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(2, 300, 300)).astype(np.float32)
    smooth = noise + np.roll(noise, 1, axis=2)
    covariance = clutter_covariance([smooth], np.ones((3, 3)), WhiteningParameters())
    correlation = covariance / covariance[0, 0]
    assert np.allclose(np.diag(correlation), 1, atol=0.05)
    assert correlation[0, 1] == pytest.approx(0.5, abs=0.05)  # its neighbour in u
    assert correlation[0, 3] == pytest.approx(0.0, abs=0.05)  # its neighbour in v
    assert correlation[0, 9] == pytest.approx(0.0, abs=0.05)  # the other plane
