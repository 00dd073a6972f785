from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.calibration.control_field import pegboard_1995
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
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import calibration_accuracy, leave_one_out
from spinewatch.calibration.solve.bundle import adjust
from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.calibration.solve.dlt import solve_dlt
from spinewatch.calibration.solve.resection import THIRTEEN, SolveParameters, resect
from spinewatch.calibration.stereo import calibrate, calibration_flags
from spinewatch.camera import Camera, Rig
from spinewatch.errors import SameImageError
from spinewatch.geometry.transforms import RigidTransform, fit_rigid
from spinewatch.planning.control_field import visible_in_both
from spinewatch.planning.disparity import disparity_grid
from spinewatch.simulation.rigs import converging_rig, random_rig, table_3_3_rig
from tests.paths import SAMPLES

CALIBRATION = SAMPLES / "calibration"
TYPICAL = tuple(str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18))
MakeShot = Callable[..., Shot]
seeds = st.integers(0, 2**32 - 1)


def moved(seed: int, tilt_deg: float = 4.0) -> RigidTransform:
    rng = np.random.default_rng(seed)
    centre = pegboard_1995().points_mm.mean(axis=0)
    R = Rotation.from_rotvec(rng.normal(0, tilt_deg, 3), degrees=True).as_matrix()
    return RigidTransform(R, centre - R @ centre + rng.normal(0, 10, 3))


def error_of(camera: Camera, true: Camera) -> float:
    return float(np.abs(camera_vector(camera) - camera_vector(true)).max())


def test_the_board_of_table_3_2_shows_the_printed_twelve_in_both_images() -> None:
    rig = table_3_3_rig()
    assert round(rig.baseline_mm) == 422
    assert round(rig.vergence_deg, 1) == 32.2
    assert visible_in_both(rig, pegboard_1995()) == TYPICAL


def test_solving_back_without_noise_is_exact(shot: MakeShot, sensor: Sensor) -> None:
    calibration = calibrate([shot()], (sensor, sensor))
    rig = table_3_3_rig()
    assert error_of(calibration.rig.left, rig.left) < 1e-7
    assert error_of(calibration.rig.right, rig.right) < 1e-7
    assert not calibration.removed


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_the_dlt_is_exact_for_a_camera_with_k1(seed: int) -> None:
    camera = random_rig(np.random.default_rng(seed)).left
    lens = (7.7, (0.03, -0.02), (0.003, 0.0), (0.0, 0.0))
    camera = Camera(camera.position_mm, camera.rotation_deg, *lens, (568, 416), (0.01, 0.00845))
    X = pegboard_1995().take(TYPICAL)
    solved = solve_dlt(ImagePoints.build(TYPICAL, X, camera.project(X)), Sensor((568, 416), (0.01, 0.00845)))
    assert np.abs(solved.camera.project(X) - camera.project(X)).max() < 1e-3
    assert abs(solved.aspect - 0.845) < 1e-5


def test_several_shots_are_adjusted_together_and_their_placements_found(
    shot: MakeShot, sensor: Sensor
) -> None:
    places = [RigidTransform.identity(), moved(1), moved(2)]
    shots = [shot(str(i), placement=p, sigma_px=0.03, seed=i) for i, p in enumerate(places)]
    calibration = calibrate(shots, (sensor, sensor))
    for found, true in zip(calibration.placements[1:], places[1:], strict=True):
        assert np.abs(found.rotation - true.rotation).max() < 1e-3
        assert np.abs(found.translation_mm - true.translation_mm).max() < 0.5
    one = calibrate(shots[:1], (sensor, sensor))
    assert calibration.sd["left"]["f"] < one.sd["left"]["f"]


def test_stated_deviations_are_those_of_repeated_calibrations(shot: MakeShot, sensor: Sensor) -> None:
    truth = camera_vector(table_3_3_rig().left)
    free = SolveParameters(free=("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1"))
    scaled = []
    for seed in range(40):
        calibration = calibrate([shot(sigma_px=0.1, seed=seed)], (sensor, sensor), free)
        sd = np.array(list(calibration.sd["left"].values()))
        scaled.append((camera_vector(calibration.rig.left) - truth)[:10] / sd)
    assert 0.75 < np.sqrt(np.mean(np.square(scaled))) < 1.45


def test_residuals_of_shots_not_used_are_reported_apart_and_larger(shot: MakeShot, sensor: Sensor) -> None:
    used, fresh = [], []
    for seed in range(12):
        calibration = calibrate([shot(sigma_px=0.1, seed=seed)], (sensor, sensor))
        accuracy = calibration_accuracy(calibration, [shot("fresh", sigma_px=0.1, seed=seed + 100)])
        assert [a.used for a in accuracy] == [True, False]
        used.append(accuracy[0].sd_mm)
        fresh.append(accuracy[1].sd_mm)
    assert np.all(np.mean(fresh, axis=0) > np.mean(used, axis=0))


def test_points_left_out_are_reconstructed_worse_than_points_used(shot: MakeShot, sensor: Sensor) -> None:
    calibration = calibrate([shot(sigma_px=0.1)], (sensor, sensor))
    left_out = leave_one_out(calibration)
    assert left_out is not None
    assert len(left_out.ids) == 12
    assert np.all(left_out.sd_mm > calibration_accuracy(calibration)[0].sd_mm)


def test_a_blunder_is_removed_and_named(shot: MakeShot, sensor: Sensor) -> None:
    good = shot(sigma_px=0.05)
    pixels = good.left.pixels.copy()
    pixels[4] += (9, -5)
    bad = Shot("C", ImagePoints.build(TYPICAL, good.left.control_mm, pixels), good.right)
    calibration = calibrate([bad], (sensor, sensor))
    assert [(r.side, r.shot, r.id) for r in calibration.removed] == [("left", "C", TYPICAL[4])]
    assert calibration.removed[0].miss_px == pytest.approx(np.hypot(9, 5), abs=3)
    assert "control-point-removed" in {f.code for f in calibration.flags}


def test_an_adjustment_stopped_on_the_way_says_so(shot: MakeShot, sensor: Sensor) -> None:
    block = calibrate([shot(sigma_px=0.05)], (sensor, sensor)).adjustment.block
    moved = replace(block.cameras[0], focal_length_mm=1.1 * block.cameras[0].focal_length_mm)
    start = replace(block, cameras=(moved, block.cameras[1]))
    for evaluations, flags in ((2, {"adjustment-unfinished"}), (200, set())):
        found = calibration_flags(adjust(start, evaluations=evaluations), {}, ())
        assert {f.code for f in found} == flags


@pytest.mark.parametrize("seed", range(8))
def test_points_that_are_named_wrong_are_refused_by_name(shot: MakeShot, sensor: Sensor, seed: int) -> None:
    good = shot()
    order = (
        np.random.default_rng(seed).permutation(len(TYPICAL)) if seed else np.roll(range(len(TYPICAL)), -1)
    )
    images = [
        ImagePoints.build([TYPICAL[k] for k in order], image.control_mm[order], image.pixels)
        for image in (good.left, good.right)
    ]
    with pytest.raises(CalibrationError):
        calibrate([Shot("C", images[0], images[1])], (sensor, sensor))


def test_a_point_with_two_places_is_named(shot: MakeShot, sensor: Sensor) -> None:
    good = shot()
    elsewhere = good.right.control_mm.copy()
    elsewhere[2, 0] += 5
    bad = Shot("C", good.left, ImagePoints.build(TYPICAL, elsewhere, good.right.pixels))
    with pytest.raises(
        PointsError, match=f"point {TYPICAL[2]} has other object coordinates in the right image"
    ):
        calibrate([bad], (sensor, sensor))


def test_heights_that_no_camera_sees_are_left_out_of_the_disparity_grid() -> None:
    rig = table_3_3_rig()
    grid = disparity_grid(rig, (0.0, rig.left.centre[2] - 1.0), planes=9)
    assert 0 < len(grid.z_mm) < 9
    assert np.all(np.isfinite(grid.distribution()[0]))


def test_three_blunders_of_some_sigma_are_named_and_good_points_stay() -> None:
    rig, field = converging_rig(500.0, 24.0, target_mm=(317.5, 254.0, 40.0)), pegboard_1995()
    sensor = Sensor(rig.left.image_size_px, rig.left.pixel_size_mm)
    off = np.zeros((30, 2))
    off[[3, 14, 21]] = (1.6, 0), (-1.2, 1.2), (0, -1.7)
    for seed in range(4):
        noise = 0.2 * np.random.default_rng(seed).standard_normal((30, 2))
        sound, faulty = (
            resect(
                [
                    ImagePoints.build(
                        field.ids, field.points_mm, rig.left.project(field.points_mm) + noise + e
                    )
                ],
                sensor,
                SolveParameters(),
            )
            for e in (np.zeros((30, 2)), off)
        )
        assert not sound.blunders
        assert {b.id for b in faulty.blunders} == {"4", "15", "22"}


def test_real_cameras_in_relief_converge_and_name_their_mismatches() -> None:
    cavity = Sensor((1280, 1024), (0.012, 0.012))
    for name, gross in (("cam1", {"31"}), ("cam4", {"31"})):
        (points,) = parse_image_points((CALIBRATION / f"openptv/{name}.csv").read_text(), name).values()
        found = resect([points], cavity, SolveParameters(free=THIRTEEN))
        assert gross <= {b.id for b in found.blunders}
        assert found.adjustment.rms_px < 0.38


def test_one_view_of_a_plane_is_refused_and_several_are_solved() -> None:
    chessboard = Sensor((640, 480), (0.01, 0.01))
    views = parse_image_points((CALIBRATION / "chessboards/left.csv").read_text(), "left")
    with pytest.raises(PlanarFieldError, match="different heights"):
        resect([views["1"]], chessboard, SolveParameters())
    found = resect([views[k] for k in ("1", "2", "3", "4", "5", "6")], chessboard, SolveParameters())
    assert found.adjustment.rms_px < 0.4
    assert found.camera.focal_length_mm / 0.01 == pytest.approx(535, abs=12)


def test_five_points_are_too_few(shot: MakeShot, sensor: Sensor) -> None:
    with pytest.raises(TooFewPointsError, match="at least 6"):
        calibrate([shot(ids=TYPICAL[:5])], (sensor, sensor))


def test_points_in_a_tilted_plane_are_refused(sensor: Sensor) -> None:
    rng = np.random.default_rng(0)
    X = rng.uniform((300, 250, 0), (560, 480, 0), (14, 3))
    X[:, 2] = 0.2 * X[:, 0] + 0.1 * X[:, 1] + rng.normal(0, 0.3, 14)
    rig = table_3_3_rig()
    ids = [str(i) for i in range(14)]
    images = [ImagePoints.build(ids, X, c.project(X)) for c in (rig.left, rig.right)]
    with pytest.raises(PlanarFieldError):
        calibrate([Shot("1", *images)], (sensor, sensor))


def test_not_a_number_and_doubles_are_refused() -> None:
    X, U = np.arange(21.0).reshape(7, 3), np.arange(14.0).reshape(7, 2)
    ids = list("abcdefg")
    with pytest.raises(PointsError, match="point c"):
        ImagePoints.build(ids, np.where(np.arange(7)[:, None] == 2, np.nan, X), U)
    with pytest.raises(PointsError, match="twice"):
        ImagePoints.build([*ids[:6], "a"], X, U)
    with pytest.raises(PointsError, match="same pixel"):
        ImagePoints.build(ids, X, U[[0, 1, 2, 3, 4, 5, 5]])


def test_exchanged_sides_are_told_from_a_board_upside_down(shot: MakeShot, sensor: Sensor) -> None:
    good = shot()
    with pytest.raises(SidesSwappedError):
        calibrate([Shot("1", good.right, good.left)], (sensor, sensor))
    half_turn = RigidTransform(np.diag([-1.0, -1.0, 1.0]), np.array([2 * 444.5, 2 * 381.0, 0.0]))
    with pytest.raises(BoardOrientationError, match="X runs to the"):
        calibrate([shot(placement=half_turn)], (sensor, sensor))


def test_one_image_given_for_both_sides_is_refused(shot: MakeShot, sensor: Sensor) -> None:
    image = shot(sigma_px=0.05).left
    with pytest.raises(SameImageError, match="shot C"):
        calibrate([Shot("C", image, image)], (sensor, sensor))


def test_a_left_handed_field_is_refused(shot: MakeShot, sensor: Sensor) -> None:
    good = shot()
    mirrored = [
        ImagePoints.build(TYPICAL, i.control_mm * (1, -1, 1), i.pixels) for i in (good.left, good.right)
    ]
    with pytest.raises(MirroredFieldError, match="right-handed"):
        calibrate([Shot("1", *mirrored)], (sensor, sensor))


def test_a_wrong_field_is_refused(shot: MakeShot, sensor: Sensor) -> None:
    good = shot()
    heights = np.random.default_rng(1).permutation(good.left.control_mm[:, 2])
    wrong = good.left.control_mm.copy()
    wrong[:, 2] = heights
    images = [ImagePoints.build(TYPICAL, wrong, i.pixels) for i in (good.left, good.right)]
    with pytest.raises((PoorFitError, MirroredFieldError, UndeterminedError)):
        calibrate([Shot("1", *images)], (sensor, sensor))


def test_parameters_can_be_fixed_and_the_aspect_estimated(shot: MakeShot, sensor: Sensor) -> None:
    fixed = calibrate(
        [shot()], (sensor, sensor), SolveParameters(fixed={"x0": 0.061}, check_orientation=False)
    )
    assert "x0" not in fixed.free["left"]
    assert fixed.rig.left.principal_point_mm[0] == 0.061
    square = Sensor((568, 416), (0.01, 0.0086))
    estimated = calibrate([shot()], (square, square), SolveParameters(estimate_aspect=True))
    px, py = estimated.rig.left.pixel_size_mm
    assert py / px == pytest.approx(0.845, abs=1e-6)


@given(seeds)
def test_absolute_orientation_finds_the_motion_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, place = rng.normal(0, 100, (5, 3)), moved(seed, 40)
    found = fit_rigid(points, place(points))
    assert np.abs(found.rotation - place.rotation).max() < 1e-9
    assert np.abs(found.inverse()(place(points)) - points).max() < 1e-7


def test_rigs_keep_their_name(shot: MakeShot, sensor: Sensor) -> None:
    assert isinstance(calibrate([shot()], (sensor, sensor), name="cart 2").rig, Rig)
    assert calibrate([shot()], (sensor, sensor), name="cart 2").rig.name == "cart 2"
