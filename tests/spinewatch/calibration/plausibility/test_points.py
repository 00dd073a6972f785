import pytest

from spinewatch.calibration.errors import PixelSizeError, PointsError
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.plausibility.points import check_image_points, check_sensor, repeated_shots
from spinewatch.calibration.points import ImagePoints, Sensor
from tests.spinewatch.calibration.simulated import SENSOR, TYPICAL, moved_board, stereo_shot

PARAMETERS = CalibrationLimits()


@pytest.mark.parametrize(
    ("factor", "unit"), [(1000.0, "micrometres"), (0.001, "metres"), (20.0, "give it in mm")]
)
def test_a_pixel_size_in_another_unit_is_refused(factor: float, unit: str) -> None:
    check_sensor(SENSOR, PARAMETERS)
    px, py = SENSOR.pixel_size_mm
    with pytest.raises(PixelSizeError, match=unit):
        check_sensor(Sensor((568, 416), (factor * px, factor * py)), PARAMETERS)


@pytest.mark.parametrize(
    ("scale", "words"),
    [(0.001, "normalized"), (2.0, "lies outside the image of 568 x 416 px")],
)
def test_image_points_are_pixels_of_the_image(scale: float, words: str) -> None:
    image = stereo_shot().left
    check_image_points([("left", image)], SENSOR, PARAMETERS)
    scaled = ImagePoints.build(image.ids, image.control_mm, scale * image.pixels)
    with pytest.raises(PointsError, match=words):
        check_image_points([("left", scaled)], SENSOR, PARAMETERS)


def test_exchanged_image_coordinates_are_named() -> None:
    image = stereo_shot().left
    exchanged = ImagePoints.build(image.ids, image.control_mm, image.pixels[:, ::-1])
    with pytest.raises(PointsError, match="or exchange u_px and v_px"):
        check_image_points([("left", exchanged)], SENSOR, PARAMETERS)


def test_a_second_exposure_of_the_same_placement_is_a_repeated_shot() -> None:
    first, again = stereo_shot("A", sigma_px=0.03), stereo_shot("B", sigma_px=0.03, seed=5)
    moved = stereo_shot("C", placement=moved_board(1, 0.0, 2.0), sigma_px=0.03)
    few = stereo_shot("D", ids=TYPICAL[:4])
    repeated = repeated_shots([first, moved, again, again], PARAMETERS)
    assert {later: earlier for later, (earlier, _) in repeated.items()} == {2: 0, 3: 0}
    assert 0.02 < repeated[2][1] < 0.08
    assert not repeated_shots([stereo_shot(ids=TYPICAL[4:]), few], PARAMETERS)
