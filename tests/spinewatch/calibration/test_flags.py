from dataclasses import replace

from spinewatch.calibration.flags import calibration_flags
from spinewatch.calibration.solve.blunders import Blunder
from spinewatch.calibration.solve.bundle import adjust
from tests.spinewatch.calibration.simulated import FIELD, TYPICAL, WIDE, image, one_camera

FREE = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1")


def test_a_sound_adjustment_has_no_flags() -> None:
    adjustment = adjust(one_camera(WIDE.left, image(WIDE.left, FIELD.ids, sigma_px=0.05), FREE))
    assert not calibration_flags(adjustment, (), ["left"], ["C"])


def test_blunders_are_flagged_with_the_names_of_camera_and_shot() -> None:
    adjustment = adjust(one_camera(WIDE.left, image(WIDE.left, FIELD.ids), FREE))
    (flag,) = calibration_flags(adjustment, [Blunder(0, 1, "7", 3.21)], ["left"], ["C", "A"])
    assert flag.code == "control-point-removed"
    assert flag.detail == "left, shot A: point 7 has a residual of 3.21 px and was removed"


def test_held_parameters_and_missing_redundancy_are_flagged() -> None:
    camera = WIDE.left
    block = one_camera(camera, image(camera, TYPICAL[:3]), FREE[:6])
    codes = [f.code for f in calibration_flags(adjust(block), (), ["left"], ["C"])]
    assert codes == ["no-redundancy", "parameters-held"]


def test_an_adjustment_stopped_by_its_limit_is_flagged() -> None:
    camera = WIDE.left
    points = image(camera, FIELD.ids, sigma_px=0.05)
    wrong = replace(camera, focal_length_mm=1.1 * camera.focal_length_mm)
    for limit, codes in ((2, ["adjustment-unfinished"]), (200, [])):
        adjustment = adjust(one_camera(wrong, points, FREE), max_evaluations=limit)
        assert [f.code for f in calibration_flags(adjustment, (), ["left"], ["C"])] == codes
