import pytest

from commands.shared.calibration_options import parse_pixel_size, parse_sensor, parse_solve_options
from spinewatch.errors import ParameterError


def test_a_sensor_has_the_cart_s_pixels_by_default() -> None:
    assert parse_sensor("568x416", None).pixel_size_mm == (0.01, 0.00845)
    given = parse_sensor("1280X1024", "0.012,0.013")
    assert (given.image_size_px, given.pixel_size_mm) == ((1280, 1024), (0.012, 0.013))


def test_solve_options() -> None:
    options = parse_solve_options("f, K1", "x0=0.5, y0=-1e-2", True)
    assert {"f", "K1"} < set(options.free or ())
    assert dict(options.fixed) == {"x0": 0.5, "y0": -0.01}
    assert options.estimate_aspect
    assert parse_solve_options(None, None, False).free is None
    assert parse_pixel_size(None) is None


@pytest.mark.parametrize("text", ["0.01", "0.01,a", "0.01,0,1", "0,0.01", "0.01,-1", "nan,1", ""])
def test_a_pixel_size_that_is_not_two_positive_numbers(text: str) -> None:
    with pytest.raises(ParameterError, match="--pixel-size"):
        parse_pixel_size(text)


@pytest.mark.parametrize("text", [None, "568", "568x", "0x416"])
def test_an_image_size_that_is_not_two_positive_numbers(text: str | None) -> None:
    with pytest.raises(ParameterError, match="--image-size"):
        parse_sensor(text, None)


@pytest.mark.parametrize(("free", "fix", "words"), [("f,zoom", None, "zoom"), (None, "x0", "NAME=NUMBER")])
def test_an_invalid_solve_option_is_named(free: str | None, fix: str | None, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        parse_solve_options(free, fix, False)


@pytest.mark.parametrize("text", ["infxinf", "568xinf", "nanx3", "1e300x1e300", "0.5x0.5", "20001x1"])
def test_an_image_size_that_no_camera_has(text: str) -> None:
    with pytest.raises(ParameterError, match=r"--image-size .* from 1 to 20000"):
        parse_sensor(text, None)


@pytest.mark.parametrize("text", ["inf,0.01", "0.01,1e300", "1e-300,1"])
def test_a_pixel_size_that_no_camera_has(text: str) -> None:
    with pytest.raises(ParameterError, match="--pixel-size"):
        parse_pixel_size(text)


@pytest.mark.parametrize("number", ["nan", "inf", "-1e300"])
def test_a_parameter_is_fixed_to_a_number_that_it_can_have(number: str) -> None:
    with pytest.raises(ParameterError, match="NAME=NUMBER"):
        parse_solve_options(None, f"x0={number}", False)
