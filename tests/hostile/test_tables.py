"""CSV tables that are no tables: very long lines, many rows, quotes without end, formulas, other encodings."""

import pytest

from tests.hostile.attack import harmless, refused
from tests.http.harness import Service, code_of

CSV = {"Content-Type": "text/csv"}
HEADER = b"vertebra,x_mm,y_mm,z_mm,coronal_deg,sagittal_deg,axial_deg\n"
TABLES = {
    "nothing": b"",
    "one long cell": b"x" * 260_000,
    "many columns": b"," * 260_000,
    "many rows": HEADER + b"\n" * 200_000,
    "many poses": HEADER + b"T7,0,0,0,0,0,0\n" * 15_000,
    "an open quote": b'"' + b"x," * 130_000,
    "quotes": b'""' * 130_000,
    "line breaks in quotes": b'"' + b"\n" * 250_000 + b'"',
    "formula": HEADER + b"=1+1,0,0,0,0,0,0\n" * 3,
    "huge numbers": HEADER + b"T7,1e999,0,0,0,0,0\nT8,0,0,0,0,0,0\n",
    "long numbers": HEADER + b"T7," + b"9" * 200_000 + b",0,0,0,0,0\nT8,0,0,0,0,0,0\n",
    "NaN": HEADER + b"T7,nan,0,0,0,0,0\nT8,inf,0,0,0,0,0\n",
    "NUL": HEADER + b"T7\0,0,0,0,0,0,0\nT8,0,0,0,0,0,0\n",
    "UTF-16": (HEADER + b"T7,0,0,0,0,0,0\n").decode().encode("utf-16"),
    "not UTF-8": b"\xff\xfe" * 1_000,
    "markup": b"<script>alert(1)</script>\n" * 10,
}


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_a_table_of_poses(service: Service, surgery: str, table: bytes) -> None:
    with harmless(service):
        answer = service.client.put(f"/v1/surgeries/{surgery}/spine/initial", content=table, headers=CSV)
    refused(service, answer)
    assert "script" not in answer.text


def test_a_table_that_is_too_large(service: Service, surgery: str) -> None:
    with harmless(service):
        answer = service.client.put(
            f"/v1/surgeries/{surgery}/spine/initial", content=b"x," * 4_000_000, headers=CSV
        )
    assert code_of(answer, 413) == "content-too-large"


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_a_control_field(service: Service, table: bytes) -> None:
    files = [("left", ("l", b"x")), ("right", ("r", b"y")), ("control_field", ("field.csv", table))]
    with harmless(service):
        answer = service.client.post("/v1/calibrations/from-images", data={"name": "rig"}, files=files)
    refused(service, answer)
    assert "script" not in answer.text
