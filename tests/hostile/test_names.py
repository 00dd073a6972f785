"""Formulas, markup and controls in names: refused, or given back as plain data that nothing executes."""

import json

import pytest

from tests.hostile.attack import JSON, harmless
from tests.http.harness import RIG, VERTEBRAE, Service, code_of, problem_of

NAMES = {
    "formula": "=cmd|'/c calc'!A1",
    "plus": "+1+1",
    "minus": "-2+3",
    "at": "@SUM(1)",
    "tab": "\t=1+1",
    "script": "<script>alert(1)</script>",
    "image": "<img src=x onerror=alert(1)>",
    "attribute": '" onmouseover="alert(1)',
    "entity": "&lt;&#x3c;&quot;",
    "XML": "<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><a>&b;</a>",
    "template": "{{7*7}}${7*7}<%= 7*7 %>",
    "SQL": "'); DROP TABLE surgeries; --",
    "format": "%s%n{0.__class__}",
    "line breaks": "a\r\nSet-Cookie: x=y",
    "bidi": "\u202ecilbup\u202c",
    "zero width": "a\u200bb\ufeff",
    "NUL": "a\0b",
    "escape": "\x1b[2J\x1b]0;title\x07",
    "path": "../../../etc/passwd",
    "combining": "e" + "\u0301" * 90,
    "astral": "\U0001f9b4" * 25,
}
HIDING = {NAMES[kind] for kind in ("tab", "line breaks", "bidi", "zero width", "NUL", "escape")}
EXPORTS = ["csv", "json", "fhir", "report-html", "slicer-markups"]


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_of_a_surgery(service: Service, name: str) -> None:
    """A reference is refused, or it comes back as it was, in JSON, and no export begins a cell or a tag with it."""
    body = {"reference": name, "vertebrae": VERTEBRAE, "reference_vertebra": "L1", "spine_axis": "x"}
    with harmless(service):
        answer = service.client.post("/v1/surgeries", json=body)
    if answer.status_code == 422:
        problem_of(answer, 422)
        assert json.dumps(name)[1:-1] not in answer.text
        return
    assert answer.status_code == 201, answer.text
    assert answer.headers["content-type"] == "application/json"
    assert answer.json()["reference"] == name
    for kind in EXPORTS:
        export = service.client.get(f"/v1/surgeries/{answer.json()['id']}/exports/{kind}")
        assert export.status_code in {200, 409, 422}, export.text
        assert "\n" not in export.headers.get("content-disposition", "")
        if export.status_code == 200 and kind == "report-html":
            assert "<script>alert" not in export.text
            assert "<img src=x" not in export.text
            assert '" onmouseover="' not in export.text


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_of_a_rig(service: Service, name: str) -> None:
    with harmless(service):
        answer = service.client.post("/v1/calibrations", json={**RIG, "name": name})
    assert answer.status_code in {201, 422}, answer.text
    assert answer.headers["content-type"] in {"application/json", "application/problem+json"}


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_of_a_field_is_not_repeated(service: Service, name: str) -> None:
    answer = service.client.post("/v1/surgeries", content=json.dumps({name: 1}), headers=JSON)
    assert code_of(answer, 422) == "invalid-request"
    assert name not in json.dumps(answer.json(), ensure_ascii=False).replace("\\", "")


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_of_a_landmark(service: Service, surgery: str, name: str) -> None:
    """Whatever cannot be seen in a name is refused, before the radiographs are looked for."""
    point = {"name": name, "pa": [0.0, 0.0], "lateral": [0.0, 0.0], "triad": "L1"}
    body = {
        "initial": {"kind": "radiographs", "pa": "a", "lateral": "b", "vertebrae": [], "common": [point] * 3}
    }
    with harmless(service):
        answer = service.client.post(f"/v1/surgeries/{surgery}/radiographs/fit", json=body)
    errors = problem_of(answer, 422)["errors"]
    named = [error for error in errors if error["loc"][-3:] == ["common", 0, "name"]]
    assert bool(named) == (len(name) > 40 or name in HIDING), answer.text


def test_nothing_of_it_begins_a_line_of_the_log(service: Service) -> None:
    service.client.get("/v1/jobs/a%0ab%0dc%1b[2J%E2%80%AE")
    service.client.get("/v1/jobs/none", headers=[(b"X-Request-ID", b"x\x85y"), (b"User-Agent", b"a\x85b")])
    text = service.log.read_text()
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert not [line for line in text.splitlines() if line.startswith(("b", "c"))]
