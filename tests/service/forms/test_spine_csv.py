import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contract.setup_checks import SpineSetupError
from service.forms.spine_csv import OPTIONAL, REQUIRED, parse_poses

HEADER = ",".join(REQUIRED)
ROWS = "t09,1,2,3,4,5,6\nL1,0,0,0,0,0,0\n"
NUMBER = st.floats(allow_nan=False, allow_infinity=False)


def test_a_row_is_a_vertebra() -> None:
    found = parse_poses(f"{HEADER}\n{ROWS}".encode(), "object")
    assert (found.kind, found.frame) == ("poses", "object")
    first, second = found.poses
    assert (first.vertebra, first.position_mm, first.angles_deg) == ("T9", [1, 2, 3], [4, 5, 6])
    assert (first.position_sd_mm, first.rotation_sd_deg, first.rotation) == (2, 3, None)
    assert second.vertebra == "L1"


def test_columns_may_come_in_any_order_with_deviations_and_a_byte_order_mark() -> None:
    columns = [*OPTIONAL, *REQUIRED[::-1]]
    text = "\ufeff" + " , ".join(columns) + "\r\n1,2,6,5,4,3,2,1,T9\r\n\r\n,,6,5,4,3,2,1,L1\r\n"
    first, second = parse_poses(text.encode(), "patient").poses
    assert (first.position_mm, first.angles_deg) == ([1, 2, 3], [4, 5, 6])
    assert (first.position_sd_mm, first.rotation_sd_deg) == (1, 2)
    assert (second.position_sd_mm, second.rotation_sd_deg) == (2, 3)


@given(st.lists(NUMBER, min_size=6, max_size=6))
def test_numbers_are_read_to_the_last_bit(numbers: list[float]) -> None:
    row = ",".join(["T9", *map(repr, numbers)])
    pose, _ = parse_poses(f"{HEADER}\n{row}\nL1,0,0,0,0,0,0".encode(), "object").poses
    assert [*pose.position_mm, *(pose.angles_deg or [])] == numbers


@pytest.mark.parametrize(
    ("text", "path"),
    [
        (b"\xff", ("csv",)),
        (b"", ("csv",)),
        (b"\n" * 2**17, ("csv",)),
        (b"\n\n", ("csv",)),
        (b'"T9', ("csv",)),
        (f"{HEADER}\n".encode(), ("csv",)),
        (f"{HEADER}\nT9,1,2,3,4,5,6\n".encode(), ("csv",)),
        (f"{HEADER},name\n{ROWS}".encode(), ("csv", "row 1")),
        (f"{HEADER},x_mm\n{ROWS}".encode(), ("csv", "row 1")),
        (f"{HEADER[:-5]}\n{ROWS}".encode(), ("csv", "row 1")),
        (f"{HEADER}\n{ROWS}T7,1,2\n".encode(), ("csv", "row 4")),
        (f"{HEADER}\n{ROWS}T7,1,2,,4,5,6\n".encode(), ("csv", "row 4", "z_mm")),
        (f"{HEADER}\n{ROWS}T7,1,2,inf,4,5,6\n".encode(), ("csv", "row 4", "z_mm")),
        (f"{HEADER}\n{ROWS}T7,1,2,=1+1,4,5,6\n".encode(), ("csv", "row 4", "z_mm")),
        (f"{HEADER}\n{ROWS}T7,1,2,1_80,4,5,6\n".encode(), ("csv", "row 4", "z_mm")),
        (f"{HEADER}\n{ROWS}T7,1,2,3,\u0661\u0662,5,6\n".encode(), ("csv", "row 4", "coronal_deg")),
        (f"{HEADER}\n{ROWS},1,2,3,4,5,6\n".encode(), ("csv", "row 4", "vertebra")),
        ((HEADER + "\n" + 31 * "T9,1,2,3,4,5,6\n").encode(), ("csv",)),
    ],
)
def test_what_is_no_such_table_is_named_by_row_and_column(text: bytes, path: tuple[str, ...]) -> None:
    with pytest.raises(SpineSetupError) as error:
        parse_poses(text, "object")
    assert (error.value.code, error.value.path) == ("invalid-csv", path)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_by_name(content: bytes) -> None:
    with contextlib.suppress(SpineSetupError):
        assert parse_poses(content, "object").poses
