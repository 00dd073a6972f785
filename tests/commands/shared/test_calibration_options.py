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
