import numpy as np
import pytest

from spinewatch.calibration.errors import UndeterminedError
from spinewatch.calibration.solve.bundle import adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES
from spinewatch.calibration.solve.determinability import (
    DeterminabilityParameters,
    check_determined,
    undetermined,
)
from tests.spinewatch.calibration.simulated import FIELD, WIDE, WIDE_SENSOR, image, one_camera

FREE = (*EXTERIOR_NAMES, "f", "x0", "y0", "K1")
POINTS = image(WIDE.left, FIELD.ids, sigma_px=0.05)


def test_limits_follow_from_the_plate_and_the_focal_length() -> None:
    limits = DeterminabilityParameters().max_sd(WIDE_SENSOR, 8.0)
    width, height = WIDE_SENSOR.plate_mm
    assert limits["f"] == 2.0
    assert (limits["x0"], limits["y0"]) == pytest.approx((width / 2, height / 2))
    corner = np.hypot(width, height) / 2
    # K1 at its limit moves the corner by a fifth of its radius.
    assert limits["K1"] * corner**3 == pytest.approx(0.2 * corner)
    assert limits["P1"] * corner**2 == pytest.approx(0.2 * corner)


def test_a_whole_board_determines_the_camera() -> None:
    adjustment = adjust(one_camera(WIDE.left, POINTS, FREE))
    assert undetermined(adjustment, WIDE_SENSOR) == ()
    check_determined(adjustment, WIDE_SENSOR, "the camera")


def test_stricter_limits_name_what_is_too_uncertain() -> None:
    adjustment = adjust(one_camera(WIDE.left, POINTS, FREE))
    strict = DeterminabilityParameters(focal_length=1e-9, distortion=1e-9)
    assert undetermined(adjustment, WIDE_SENSOR, strict) == ("f", "K1")
    with pytest.raises(
        UndeterminedError, match="the left camera: the points do not determine f, K1"
    ) as raised:
        check_determined(adjustment, WIDE_SENSOR, "the left camera", strict)
    assert raised.value.names == ("f", "K1")


def test_singular_equations_leave_everything_undetermined_and_exact_ones_nothing() -> None:
    singular = adjust(one_camera(WIDE.left, POINTS.keep(np.arange(30) < 3), FREE))
    assert undetermined(singular, WIDE_SENSOR) == FREE
    exact = adjust(one_camera(WIDE.left, POINTS.keep(np.arange(30) < 3), EXTERIOR_NAMES))
    assert exact.block.dof == 0
    assert undetermined(exact, WIDE_SENSOR) == ()
