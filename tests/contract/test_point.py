import numpy as np

from contract.point import Points
from spinewatch.geometry.triangulation import Triangulation


def test_a_point_has_its_images_and_deviations() -> None:
    covariance = np.diag([0.01, 0.04, 0.25])[None]
    found = Triangulation(np.array([[1.0, 2.0, 3.0]]), covariance, np.array([0.5]), np.array([1.0]))
    (point,) = Points.of(found, ([[10.0, 20.0]], [[30.0, 40.0]]), "object space", 0.1).points
    assert (point.left, point.right) == ([10.0, 20.0], [30.0, 40.0])
    assert (point.position_mm, point.parallax_mm) == ([1.0, 2.0, 3.0], 0.5)
    np.testing.assert_allclose(point.position_sd_mm, [0.1, 0.2, 0.5])
