from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.errors import RigError
from spinewatch.rig_files.thesis_1995 import format_1995, parse_1995
from spinewatch.simulation.rigs import random_rig, table_3_3_rig

PRINTED = """# Table 3.3
LEFT  223.9545 442.5372 743.9232 -50609.0 -165732.2 12336.1 7.776 .061 .078 .29E-02 0 0 0
RIGHT 645.7806 442.3287 734.5083 -42648.9 151302.0 -15556.3 7.556 .018 .090 .33E-02 0 0 0
"""


def test_the_printed_table_is_read_with_its_distortion_about_the_plate_origin() -> None:
    rig, fit_error_px = parse_1995(PRINTED, "C")
    printed = table_3_3_rig()
    assert rig.name == "C"
    assert fit_error_px < 0.02
    for camera, parameters in ((rig.left, printed.left), (rig.right, printed.right)):
        assert camera.position_mm == parameters.position_mm
        assert pytest.approx(parameters.M, abs=0.006) == camera.M
        assert camera.focal_length_mm == pytest.approx(parameters.focal_length_mm, abs=1e-3)


def test_without_distortion_every_number_is_kept() -> None:
    text = PRINTED.replace(".29E-02", "0").replace(".33E-02", "0")
    rig, fit_error_px = parse_1995(text, "C")
    assert fit_error_px == 0
    assert rig.left.focal_length_mm == 7.776
    assert rig.left.rotation_deg == table_3_3_rig().left.rotation_deg


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_round_trip_keeps_all_rays_within_the_stated_errors(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    text, out_px = format_1995(rig)
    back, in_px = parse_1995(text, rig.name, rig.left.image_size_px, rig.left.pixel_size_mm)
    assert max(out_px, in_px) < 0.1
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert again.position_mm == camera.position_mm
        w, h = camera.image_size_px
        pixels = np.random.default_rng(seed).uniform(0, (w - 1, h - 1), (50, 2))
        points = camera.centre + 700 * camera.directions(pixels)
        assert np.abs(again.project(points) - pixels).max() <= 1.5 * (out_px + in_px) + 1e-5


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("7.776", "x", "not a number"),
        ("7.776", "7_776", "underscore"),
        ("7.776", "inf", "not finite"),
        ("7.776", "7,776", "decimal point"),
        ("7.776", "inf", "finite"),
        ("7.776", "-7.776", "positive"),
        ("-50609.0", "-57609.0", "below 60"),
        ("RIGHT", "LEFT", "twice"),
        ("RIGHT", "MIDDLE", "neither"),
        ("RIGHT", "#", "missing"),
        (" 0 0 0\n", "\n", "numbers"),
    ],
)
def test_errors_name_the_problem(old: str, new: str, problem: str) -> None:
    with pytest.raises(RigError, match=problem):
        parse_1995(PRINTED.replace(old, new, 1), "C")


def with_angles(write: Callable[[float], str]) -> str:
    rig = table_3_3_rig()
    lines = []
    for line in PRINTED.splitlines()[1:]:
        words = line.split()
        angles = rig.left.rotation_deg if words[0] == "LEFT" else rig.right.rotation_deg
        lines.append(" ".join([*words[:4], *map(write, angles), *words[7:]]))
    return "\n".join(lines)


def _degrees_minutes(angle: float) -> str:
    degrees, minutes = divmod(abs(angle) * 60, 60)
    return f"{'-' if angle < 0 else ''}{degrees:.0f}{minutes:02.0f}"


@pytest.mark.parametrize(
    ("write", "unit"),
    [
        (lambda angle: f"{angle:.4f}", "decimal degrees"),
        (lambda angle: f"{angle:.0f}", "decimal degrees"),
        (lambda angle: f"{np.radians(angle):.7f}", "radians"),
        (_degrees_minutes, "DDDMM"),
        (lambda angle: f"{angle / 4000:.6f}", "decimal degrees or radians"),
    ],
)
def test_angles_that_are_not_packed_are_named(write: Callable[[float], str], unit: str) -> None:
    with pytest.raises(RigError, match=f"cannot be DDDMMSS.*{unit}"):
        parse_1995(with_angles(write), "C")


@pytest.mark.parametrize("phi", ["0", "-163000.0"])
def test_parallel_axes_are_read(phi: str) -> None:
    rig, _ = parse_1995(with_angles(lambda _: phi), "C")
    assert rig.vergence_deg < 0.2  # the fitted principal points move the axes
