import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.errors import RigError
from spinewatch.geometry.angles import degrees_from_dms
from spinewatch.rig_files.thesis_1995 import dms_from_degrees, parse_1995, write_1995
from spinewatch.simulation.rigs import random_rig, table_3_3_rig

PRINTED = """# Table 3.3
LEFT  223.9545 442.5372 743.9232 -50609.0 -165732.2 12336.1 7.776 .061 .078 .29E-02 0 0 0
RIGHT 645.7806 442.3287 734.5083 -42648.9 151302.0 -15556.3 7.556 .018 .090 .33E-02 0 0 0
"""


def test_the_printed_table_is_read() -> None:
    rig, known = parse_1995(PRINTED, "C"), table_3_3_rig()
    assert np.array_equal(camera_vector(rig.left), camera_vector(known.left))
    assert np.array_equal(camera_vector(rig.right), camera_vector(known.right))


@given(st.integers(0, 2**32 - 1))
def test_a_written_file_gives_the_rig_back(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    back = parse_1995(write_1995(rig), rig.name)
    assert np.abs(camera_vector(back.left) - camera_vector(rig.left)).max() < 1e-10


@given(st.floats(-180, 180))
def test_angles_survive_degrees_minutes_and_seconds(angle: float) -> None:
    assert degrees_from_dms(float(dms_from_degrees(angle))) == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("7.776", "x", "not a number"),
        ("-50609.0", "-57609.0", "below 60"),
        ("RIGHT", "LEFT", "twice"),
        (" 0 0 0\n", "\n", "numbers"),
    ],
)
def test_damaged_files_say_what_is_wrong(old: str, new: str, problem: str) -> None:
    with pytest.raises(RigError, match=problem):
        parse_1995(PRINTED.replace(old, new, 1), "C")
