from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.camera import Camera
from spinewatch.errors import RigError
from spinewatch.rig_files.rig_json import camera_to_dict
from spinewatch.rig_files.thesis_1995 import format_1995, parse_1995
from spinewatch.simulation.rigs import random_rig, table_3_3_rig

PRINTED = """# Table 3.3
LEFT  223.9545 442.5372 743.9232 -50609.0 -165732.2 12336.1 7.776 .061 .078 .29E-02 0 0 0
RIGHT 645.7806 442.3287 734.5083 -42648.9 151302.0 -15556.3 7.556 .018 .090 .33E-02 0 0 0
"""


def test_the_printed_table_is_read() -> None:
    rig, known = parse_1995(PRINTED, "C"), table_3_3_rig()
    assert camera_to_dict(rig.left) == camera_to_dict(known.left)
    assert camera_to_dict(rig.right) == camera_to_dict(known.right)
    assert rig.name == "C"


@given(st.integers(0, 2**32 - 1))
def test_round_trip_keeps_every_number_and_rounds_angles(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    back = parse_1995(format_1995(rig), rig.name)
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert without_angles(again) == without_angles(camera)
        assert again.rotation_deg == pytest.approx(camera.rotation_deg, abs=1e-10)


def without_angles(camera: Camera) -> dict[str, object]:
    return {key: value for key, value in camera_to_dict(camera).items() if key != "rotation_deg"}


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("7.776", "x", "not a number"),
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
    rig = parse_1995(with_angles(lambda _: phi), "C")
    assert rig.vergence_deg < 1e-6
