import numpy as np
import pytest

from spinewatch.arrays import Float, Int
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    MirroredFieldError,
    PlanarFieldError,
    PointsError,
    PoorFitError,
    SidesSwappedError,
    TooFewPointsError,
    UndeterminedError,
)
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo, readjust
from spinewatch.errors import SameImageError
from spinewatch.geometry.transforms import RigidTransform
from tests.spinewatch.calibration.simulated import (
    IDENTITY,
    SENSORS,
    TABLE_3_3,
    TYPICAL,
    moved_board,
    parameter_error,
    stereo_shot,
)


def renamed(shot: Shot, order: Int) -> Shot:
    left, right = (
        ImagePoints.build([i.ids[k] for k in order], i.control_mm[order], i.pixels) for i in shot.images
    )
    return Shot(shot.name, left, right)


def with_control(shot: Shot, control_mm: Float) -> Shot:
    left, right = (ImagePoints.build(i.ids, control_mm, i.pixels) for i in shot.images)
    return Shot(shot.name, left, right)


def test_solving_back_without_noise_is_exact() -> None:
    calibration = calibrate_stereo([stereo_shot()], SENSORS, name="cart 2")
    assert calibration.rig.name == "cart 2"
    assert parameter_error(calibration.rig.left, TABLE_3_3.left) < 1e-7
    assert parameter_error(calibration.rig.right, TABLE_3_3.right) < 1e-7
    assert not calibration.blunders


def test_several_shots_are_adjusted_together_and_their_placements_found() -> None:
    placements = [IDENTITY, moved_board(1), moved_board(2)]
    shots = [stereo_shot(str(i), placement=p, sigma_px=0.03, seed=i) for i, p in enumerate(placements)]
    calibration = calibrate_stereo(shots, SENSORS)
    for found, true in zip(calibration.placements[1:], placements[1:], strict=True):
        assert np.abs(found.rotation - true.rotation).max() < 1e-3
        assert np.abs(found.translation_mm - true.translation_mm).max() < 0.5
    one = calibrate_stereo(shots[:1], SENSORS)
    assert calibration.sd["left"]["f"] < one.sd["left"]["f"]


def test_stated_deviations_are_those_of_repeated_calibrations() -> None:
    truth = camera_vector(TABLE_3_3.left)
    free = SolveParameters(free=("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1"))
    scaled = []
    for seed in range(40):
        calibration = calibrate_stereo([stereo_shot(sigma_px=0.1, seed=seed)], SENSORS, free)
        sd = np.array(list(calibration.sd["left"].values()))
        scaled.append((camera_vector(calibration.rig.left) - truth)[:10] / sd)
    assert 0.75 < np.sqrt(np.mean(np.square(scaled))) < 1.45


def test_readjusting_to_better_points_keeps_the_free_parameters_and_improves_the_rig() -> None:
    rough = calibrate_stereo([stereo_shot(sigma_px=0.2)], SENSORS)
    better = readjust(rough, [stereo_shot()])
    assert better.free == rough.free
    assert max(better.rms_px.values()) < 1e-6
    assert abs(better.rig.baseline_mm - TABLE_3_3.baseline_mm) < 1e-4


def test_a_blunder_is_removed_and_named() -> None:
    good = stereo_shot(sigma_px=0.05)
    pixels = good.left.pixels.copy()
    pixels[4] += (9, -5)
    bad = Shot("C", ImagePoints.build(TYPICAL, good.left.control_mm, pixels), good.right)
    calibration = calibrate_stereo([bad], SENSORS)
    assert [(b.camera, b.shot, b.id) for b in calibration.blunders] == [(0, 0, TYPICAL[4])]
    assert calibration.blunders[0].residual_px == pytest.approx(np.hypot(9, 5), abs=3)
    assert "control-point-removed" in {f.code for f in calibration.flags}
    (cleaned,) = calibration.without_blunders()
    assert TYPICAL[4] not in cleaned.left.ids
    assert cleaned.right.ids == TYPICAL


@pytest.mark.parametrize("seed", range(8))
def test_points_that_are_named_wrong_are_refused(seed: int) -> None:
    order = np.random.default_rng(seed).permutation(12) if seed else np.roll(np.arange(12), -1)
    with pytest.raises(CalibrationError):
        calibrate_stereo([renamed(stereo_shot(), order)], SENSORS)


def test_a_point_with_two_object_coordinates_is_named() -> None:
    good = stereo_shot()
    other = good.right.control_mm.copy()
    other[2, 0] += 5
    bad = Shot("C", good.left, ImagePoints.build(TYPICAL, other, good.right.pixels))
    with pytest.raises(
        PointsError, match=f"point {TYPICAL[2]} has other object coordinates in the right image"
    ):
        calibrate_stereo([bad], SENSORS)


def test_five_points_are_too_few_and_no_shot_is_none() -> None:
    with pytest.raises(TooFewPointsError, match="at least 6"):
        calibrate_stereo([stereo_shot(ids=TYPICAL[:5])], SENSORS)
    with pytest.raises(TooFewPointsError, match="at least one stereo pair"):
        calibrate_stereo([], SENSORS)


def test_a_shot_that_no_camera_has_in_view_is_refused_by_name() -> None:
    with pytest.raises(TooFewPointsError, match="shot B in view; leave the shot out"):
        calibrate_stereo([stereo_shot(), stereo_shot("B", TYPICAL[:3])], SENSORS)


def test_points_in_a_tilted_plane_are_refused() -> None:
    rng = np.random.default_rng(0)
    X = rng.uniform((300, 250, 0), (560, 480, 0), (14, 3))
    X[:, 2] = 0.2 * X[:, 0] + 0.1 * X[:, 1] + rng.normal(0, 0.3, 14)
    ids = [str(i) for i in range(14)]
    left, right = (ImagePoints.build(ids, X, c.project(X)) for c in (TABLE_3_3.left, TABLE_3_3.right))
    with pytest.raises(PlanarFieldError):
        calibrate_stereo([Shot("1", left, right)], SENSORS)


def test_exchanged_sides_are_distinguished_from_a_board_upside_down() -> None:
    good = stereo_shot()
    with pytest.raises(SidesSwappedError):
        calibrate_stereo([Shot("1", good.right, good.left)], SENSORS)
    half_turn = RigidTransform(np.diag([-1.0, -1.0, 1.0]), np.array([2 * 444.5, 2 * 381.0, 0.0]))
    with pytest.raises(BoardOrientationError, match="X runs to the"):
        calibrate_stereo([stereo_shot(placement=half_turn)], SENSORS)


def test_one_image_given_for_both_sides_is_refused() -> None:
    points = stereo_shot(sigma_px=0.05).left
    with pytest.raises(SameImageError, match="shot C"):
        calibrate_stereo([Shot("C", points, points)], SENSORS)


def test_a_left_handed_field_is_refused() -> None:
    good = stereo_shot()
    with pytest.raises(MirroredFieldError, match="right-handed"):
        calibrate_stereo([with_control(good, good.left.control_mm * (1, -1, 1))], SENSORS)


def test_a_field_with_wrong_heights_is_refused() -> None:
    good = stereo_shot()
    wrong = good.left.control_mm.copy()
    wrong[:, 2] = np.random.default_rng(1).permutation(wrong[:, 2])
    with pytest.raises((PoorFitError, MirroredFieldError, UndeterminedError)):
        calibrate_stereo([with_control(good, wrong)], SENSORS)


def test_parameters_can_be_fixed_and_the_aspect_estimated() -> None:
    fixed = calibrate_stereo(
        [stereo_shot()], SENSORS, SolveParameters(fixed={"x0": 0.061}, check_orientation=False)
    )
    assert "x0" not in fixed.free["left"]
    assert fixed.rig.left.principal_point_mm[0] == 0.061
    square = Sensor((568, 416), (0.01, 0.0086))
    estimated = calibrate_stereo([stereo_shot()], (square, square), SolveParameters(estimate_aspect=True))
    px, py = estimated.rig.left.pixel_size_mm
    assert py / px == pytest.approx(0.845, abs=1e-6)


def test_a_fixed_height_of_a_camera_stays_where_it_was_fixed() -> None:
    Z0 = TABLE_3_3.left.position_mm[2]
    parameters = SolveParameters(fixed={"Z0": Z0}, check_orientation=False)
    left = calibrate_stereo([stereo_shot(sigma_px=0.05)], SENSORS, parameters).rig.left
    assert left.position_mm[2] == Z0
