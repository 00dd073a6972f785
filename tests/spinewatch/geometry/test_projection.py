import numpy as np

from spinewatch.geometry.projection import PinholeStack
from spinewatch.simulation.rigs import table_3_3_rig


def test_the_jacobian_is_the_derivative_of_the_projection() -> None:
    pinhole, X = table_3_3_rig().left.pinhole, np.array([[430.0, 400.0, 90.0], [350.0, 300.0, 0.0]])
    _, J = pinhole.project(X)
    for k, d in enumerate(1e-4 * np.eye(3)):
        numeric = (pinhole.project(X + d)[0] - pinhole.project(X - d)[0]) / 2e-4
        assert np.allclose(J[..., k], numeric, atol=1e-9)


def test_rays_pass_the_points_of_their_images() -> None:
    pinhole, X = table_3_3_rig().right.pinhole, np.array([[430.0, 400.0, 90.0]])
    ray = pinhole.rays(pinhole.project(X)[0])[0]
    assert np.allclose(np.cross(ray, X[0] - pinhole.centre_mm), 0, atol=1e-9)
    assert ray @ (X[0] - pinhole.centre_mm) > 0


def test_points_behind_the_camera_are_not_in_front() -> None:
    pinhole, X = table_3_3_rig().left.pinhole, np.array([430.0, 400.0, 90.0])
    assert pinhole.in_front(X)
    assert not pinhole.in_front(2 * pinhole.centre_mm - X)


def test_a_stack_projects_as_its_cameras() -> None:
    rig, X = table_3_3_rig(), np.array([[430.0, 400.0, 90.0], [350.0, 300.0, 0.0]])
    cameras = rig.left.pinhole, rig.right.pinhole
    stack = PinholeStack.of(cameras)
    ideal, J = stack.project(X.T)
    for k, camera in enumerate(cameras):
        expected, J_expected = camera.project(X)
        assert np.allclose(ideal[k].T, expected, atol=1e-12)
        assert np.allclose(J[k].transpose(2, 0, 1), J_expected, atol=1e-12)
    assert (stack.ideal(X.T) == ideal).all()
