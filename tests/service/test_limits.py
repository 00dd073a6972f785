import re

import pytest

from service import limits
from service.app import create_app
from service.declared_routes import DeclaredRoute
from service.limits import max_body_bytes
from settings import Settings
from tests.paths import PROJECT

SETTINGS = Settings(max_json_bytes=1_024, max_document_bytes=2_048, max_upload_bytes=4_096)


def route(path: str, media_type: str | None) -> DeclaredRoute:
    return DeclaredRoute(path, frozenset({"POST"}), {}, media_type)


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        (None, 1_024),
        (route("/v1/surgeries", "application/json"), 1_024),
        (route("/v1/jobs/{job_id}/cancel", None), 1_024),
        (route("/v1/calibrations", "application/json"), 2_048),
        (route("/v1/surgeries/{surgery_id}/spine", "application/json"), 2_048),
        (route("/v1/surgeries/{surgery_id}/spine/initial", "text/csv"), 2_048),
        (route("/v1/surgeries/{surgery_id}/stages", "multipart/form-data"), 4_096),
    ],
)
def test_the_largest_body(declared: DeclaredRoute | None, expected: int) -> None:
    assert max_body_bytes(declared, SETTINGS) == expected


def test_the_defaults() -> None:
    assert Settings().max_json_bytes == 64 * 1024
    assert Settings().max_document_bytes == 256 * 1024


def test_the_documents_are_routes() -> None:
    assert set(create_app(Settings()).openapi()["paths"]) >= limits._DOCUMENTS


def test_the_manual_lists_every_fixed_limit() -> None:
    page = (PROJECT / "docs" / "operations.md").read_text()
    (table,) = re.findall(r"## Fixed limits\n.*?\n(\|.*?)\n\n", page, re.DOTALL)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
    listed = {name.strip("`"): int(value.replace(" ", "")) for name, value, _ in rows}
    fixed = {
        name: value for name, value in vars(limits).items() if name.isupper() and not name.startswith("_")
    }
    assert listed == fixed
