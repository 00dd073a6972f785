import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.errors import ConvergenceError, PlanarFieldError, PoorFitError
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.calibration.solve.collinearity import THESIS_NAMES
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.solve.resection import resect
from spinewatch.simulation.rigs import random_rig
from tests.paths import SAMPLES
from tests.spinewatch.calibration.simulated import (
    FIELD,
    SENSOR,
    TABLE_3_3,
    TYPICAL,
    WIDE,
    WIDE_SENSOR,
    image,
    moved_board,
    parameter_error,
)

PARAMETERS = SolveParameters()
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
@settings(max_examples=8, deadline=None)
def test_a_camera_with_any_lens_is_resected_exactly(seed: int) -> None:
    camera = random_rig(np.random.default_rng(seed)).left
    found = resect([image(camera)], SENSOR, PARAMETERS)
    X = FIELD.take(TYPICAL)
    assert np.abs(found.camera.project(X) - camera.project(X)).max() < 1e-3


def test_a_shot_out_of_view_is_left_out() -> None:
    placement = moved_board(3)
    shots = [image(WIDE.left, FIELD.ids), None, image(WIDE.left, FIELD.ids, placement)]
    found = resect(shots, WIDE_SENSOR, PARAMETERS)
    assert found.shots == (0, 2)
    assert np.allclose(found.placements[2].translation_mm, placement.translation_mm, atol=1e-3)
    assert parameter_error(found.camera, WIDE.left) < 1e-5


def test_blunders_are_numbered_by_shot() -> None:
    offsets = np.zeros((30, 2))
    offsets[6] = 8.0
    bad = image(WIDE.left, FIELD.ids, moved_board(3), 0.05, offsets_px=offsets)
    found = resect([image(WIDE.left, FIELD.ids, sigma_px=0.05), None, bad], WIDE_SENSOR, PARAMETERS)
    assert [(b.shot, b.id) for b in found.blunders] == [(2, "7")]


def test_fixed_parameters_keep_their_values() -> None:
    x0, f = TABLE_3_3.left.principal_point_mm[0], TABLE_3_3.left.focal_length_mm
    found = resect([image(TABLE_3_3.left)], SENSOR, SolveParameters(fixed={"x0": x0, "f": f}))
    assert found.camera.principal_point_mm[0] == x0
    assert found.camera.focal_length_mm == f
    assert {"x0", "f"}.isdisjoint(found.free)


def test_points_that_fit_no_camera_are_no_undetermined_parameters() -> None:
    sound = image(TABLE_3_3.right)
    pixels = sound.pixels.copy()
    pixels[[0, 6]] = pixels[[6, 0]]
    exchanged = ImagePoints.build(sound.ids, sound.control_mm, pixels)
    with pytest.raises(PoorFitError, match=r"^the camera: the image residuals .* named correctly"):
        resect([exchanged], SENSOR, PARAMETERS)


def test_a_poor_fit_and_points_out_of_view_are_refused_by_name() -> None:
    noisy = image(WIDE.left, FIELD.ids, sigma_px=4.0)
    with pytest.raises(PoorFitError, match=r"camera 7: .*px RMS"):
        resect([noisy], WIDE_SENSOR, PARAMETERS, "camera 7")
    few = ImagePoints.build(("a", "b"), FIELD.points_mm[:2], np.array([[1.0, 2.0], [3.0, 4.0]]))
    with pytest.raises(ConvergenceError, match="camera 7: no initial value"):
        resect([few], WIDE_SENSOR, SolveParameters(fixed={"f": 7.0}), "camera 7")


def test_real_cameras_in_relief_converge_and_their_mismatches_are_found() -> None:
    cavity = Sensor((1280, 1024), (0.012, 0.012))
    for name in ("cam1", "cam4"):
        text = (SAMPLES / f"calibration/openptv/{name}.csv").read_text()
        (points,) = parse_image_points(text, name).values()
        found = resect([points], cavity, SolveParameters(free=THESIS_NAMES))
        assert "31" in {b.id for b in found.blunders}
        assert found.adjustment.rms_px < 0.38


def test_one_image_of_a_plane_is_refused_and_several_are_solved() -> None:
    chessboard = Sensor((640, 480), (0.01, 0.01))
    text = (SAMPLES / "calibration/chessboards/left.csv").read_text()
    shots = list(parse_image_points(text, "left").values())
    with pytest.raises(PlanarFieldError, match="different heights"):
        resect(shots[:1], chessboard, PARAMETERS)
    found = resect(shots[:6], chessboard, PARAMETERS)
    assert found.adjustment.rms_px < 0.4
    assert found.camera.focal_length_mm / 0.01 == pytest.approx(535, abs=12)
