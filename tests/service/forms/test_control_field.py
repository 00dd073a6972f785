import io

import pytest
from fastapi import UploadFile

from service.forms.control_field import read_control_field
from service.problems import InvalidInputError

CSV = "id,x_mm,y_mm,z_mm\n1,0,0,0\n"


def upload(content: bytes, name: str | None = "board.csv") -> UploadFile:
    return UploadFile(io.BytesIO(content), filename=name)


def test_a_line_of_text_is_the_name_of_a_built_in_field() -> None:
    assert read_control_field("pegboard-1995") == ("pegboard-1995", None)


def test_lines_of_text_are_a_table() -> None:
    assert read_control_field(CSV) == ("control field", CSV)


def test_a_file_is_a_table_named_after_the_file() -> None:
    assert read_control_field(upload(CSV.encode())) == ("board.csv", CSV)
    assert read_control_field(upload(CSV.encode(), None)) == ("control field", CSV)
    assert len(read_control_field(upload(b"", "x" * 1000))[0]) == 200


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"\xff\xfe", "not UTF-8"),
        (b"id\0", "not a text file"),
        (b"1" * (64 * 1024 + 1), "more than 65536 bytes"),
    ],
)
def test_a_file_that_is_not_a_table_is_rejected(content: bytes, reason: str) -> None:
    with pytest.raises(InvalidInputError, match=reason) as raised:
        read_control_field(upload(content))
    assert raised.value.code == "invalid-control-field"
    assert raised.value.loc == ["body", "control_field"]


def test_a_long_text_is_rejected() -> None:
    with pytest.raises(InvalidInputError, match="more than 65536 bytes"):
        read_control_field("1\n" * 40_000)
