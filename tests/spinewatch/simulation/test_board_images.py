import numpy as np
import pytest

from spinewatch.calibration.control_field import ControlField, pegboard_1995
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.board_images import BoardStyle, render_board
from spinewatch.simulation.rigs import table_3_3_rig

CAMERA = table_3_3_rig().left
FLAT = RigidTransform.identity()
SHARP = BoardStyle(noise=0.0, samples=3)


def render(field: ControlField, placement: RigidTransform = FLAT, style: BoardStyle = SHARP) -> np.ndarray:
    return render_board(CAMERA, field, placement, np.random.default_rng(0), style)


def one_peg(height_mm: float) -> ControlField:
    return ControlField("one", ("1",), np.array([[434.0, 390.0, height_mm]]))


def dark_centroid(image: np.ndarray, around: np.ndarray, radius: float = 8.5) -> np.ndarray:
    """Return the centroid of the mark within the peg top."""
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    top = np.hypot(u - around[0], v - around[1]) < radius
    weight = np.clip(180 - image[top].astype(float), 0, None)
    return np.asarray(np.array([(weight * u[top]).sum(), (weight * v[top]).sum()]) / weight.sum())


@pytest.mark.parametrize("height", [0.0, 60.0, 100.0])
def test_the_mark_is_where_the_control_point_projects(height: float) -> None:
    field = one_peg(height)
    pixel = CAMERA.project(field.points_mm)[0]
    assert np.abs(dark_centroid(render(field), pixel) - pixel).max() < 0.1


def test_a_placement_moves_the_board() -> None:
    field = one_peg(50.0)
    placement = RigidTransform(rotation_from_angles(5.0, -4.0, 0.0), np.array([20.0, -30.0, 10.0]))
    pixel = CAMERA.project(placement(field.points_mm))[0]
    assert np.abs(dark_centroid(render(field, placement), pixel) - pixel).max() < 0.15


def test_gray_levels_are_those_of_the_style() -> None:
    field = one_peg(0.0)
    image = render(field, style=BoardStyle(noise=0.0, board=100, top=200, ink=30, blur_px=0.01, samples=3))
    u, v = np.rint(CAMERA.project(field.points_mm)[0]).astype(int)
    assert image[v, u] == 30
    assert image[v, u + 7] == 200
    assert image[v, u + 14] == 100
    assert image[5, 5] < 10


def test_a_cross_has_arms_along_the_axes_of_the_board() -> None:
    field = one_peg(0.0)
    image = render(field, style=BoardStyle(mark="cross", mark_mm=14, noise=0.0, samples=3))
    points = np.array([[0.0, 0], [6, 0], [0, 6], [5, 5]])
    pixels = CAMERA.project(np.column_stack([points + np.array([434, 390]), np.zeros(4)]))
    levels = [image[v, u] for u, v in np.rint(pixels).astype(int)]
    assert max(levels[:3]) < 150 < levels[3]


def test_a_high_peg_hides_what_is_behind_it() -> None:
    near = CAMERA.centre[:2] - (434.0, 390.0)
    beside = np.array([434.0, 390.0]) + 25 * near / np.linalg.norm(near)
    points = np.array([[434.0, 390.0, 0.0], [*beside, 110.0]])
    alone, both = render(one_peg(0.0)), render(ControlField("two", ("1", "2"), points))
    u, v = np.rint(CAMERA.project(points)[0]).astype(int)
    assert alone[v, u] < 60
    assert both[v, u] != alone[v, u]


def test_noise_has_its_standard_deviation_and_follows_the_seed() -> None:
    field = pegboard_1995()
    exact = render(field).astype(float)
    noisy = render(field, style=BoardStyle(noise=5.0, samples=3)).astype(float)
    middle = (exact > 30) & (exact < 225)
    assert (noisy - exact)[middle].std() == pytest.approx(5, rel=0.05)
    assert np.array_equal(noisy, render(field, style=BoardStyle(noise=5.0, samples=3)))
