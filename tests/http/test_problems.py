"""Every invalid request is answered with a problem that does not repeat the input."""

import json
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from store.revision import REVISION
from tests.backends import run_sql
from tests.http.harness import RIG, Service, code_of, pair, problem_of, wait_for
from tests.patience import PATIENCE_S

SURGERY = {
    "reference": "2026-0417",
    "vertebrae": ["L1", "T11"],
    "reference_vertebra": "L1",
    "spine_axis": "x",
}
MARKER = "c0ffee-marker"


def without(document: dict[str, Any], *path: str) -> dict[str, Any]:
    copy = json.loads(json.dumps(document))
    entry = copy
    for key in path[:-1]:
        entry = entry[key]
    del entry[path[-1]]
    return copy  # type: ignore[no-any-return]


def with_(document: dict[str, Any], value: Any, *path: str) -> dict[str, Any]:
    copy = json.loads(json.dumps(document))
    entry = copy
    for key in path[:-1]:
        entry = entry[key]
    entry[path[-1]] = value
    return copy  # type: ignore[no-any-return]


BAD_SURGERIES: list[tuple[Any, list[str | int]]] = [
    (without(SURGERY, "reference"), ["body", "reference"]),
    (with_(SURGERY, "", "reference"), ["body", "reference"]),
    (with_(SURGERY, 17, "reference"), ["body", "reference"]),
    (with_(SURGERY, "z", "spine_axis"), ["body", "spine_axis"]),
    (with_(SURGERY, [], "vertebrae"), ["body", "vertebrae"]),
    (with_(SURGERY, ["L1", MARKER], "vertebrae"), ["body", "vertebrae", 1]),
    (with_(SURGERY, ["L1", "l01"], "vertebrae"), ["body", "vertebrae"]),
    (with_(SURGERY, ["L1", "T9", "T11"], "vertebrae"), ["body", "vertebrae"]),
    (with_(SURGERY, ["L1", "T77"], "vertebrae"), ["body", "vertebrae", 1]),
    (with_(SURGERY, ["T14"], "extra_levels"), ["body", "extra_levels", 0]),
    (with_(SURGERY, "T5", "reference_vertebra"), ["body"]),
    (with_(SURGERY, MARKER, "patient_name"), ["body", "patient_name"]),
    ([SURGERY], ["body"]),
    ("text", ["body"]),
]
BAD_RIGS: list[tuple[Any, list[str | int]]] = [
    (without(RIG, "right"), ["body", "right"]),
    (without(RIG, "left", "focal_length_mm"), ["body", "left", "focal_length_mm"]),
    (with_(RIG, 0, "left", "focal_length_mm"), ["body", "left", "focal_length_mm"]),
    (with_(RIG, MARKER, "left", "focal_length_mm"), ["body", "left", "focal_length_mm"]),
    (with_(RIG, True, "left", "focal_length_mm"), ["body", "left", "focal_length_mm"]),
    (with_(RIG, [0, 0], "right", "position_mm"), ["body", "right", "position_mm"]),
    (with_(RIG, [568.5, 416], "left", "image_size_px"), ["body", "left", "image_size_px"]),
    (with_(RIG, [0.01, -0.01], "left", "pixel_size_mm"), ["body", "left", "pixel_size_mm"]),
    (with_(RIG, RIG["left"]["position_mm"], "right", "position_mm"), ["body", "right", "position_mm"]),
    (with_(RIG, [568, 100_001], "left", "image_size_px"), ["body", "left", "image_size_px"]),
    (with_(RIG, 201 * "x", "name"), ["body", "name"]),
    (with_(RIG, [10.0, 8.45], "right", "pixel_size_mm"), ["body", "right", "pixel_size_mm"]),
    (with_(RIG, 1e12, "left", "focal_length_mm"), ["body", "left", "focal_length_mm"]),
    (with_(RIG, [174.9, 15.2, -1.9], "right", "rotation_deg"), ["body", "right", "rotation_deg"]),
    (with_(RIG, 1, "left", "unknown"), ["body", "left", "unknown"]),
    (with_(RIG, 1, "left", f"<{MARKER}>"), ["body", "(unprintable)"]),
]


@pytest.mark.parametrize(
    ("path", "body", "loc"),
    [("/v1/surgeries", *bad) for bad in BAD_SURGERIES] + [("/v1/calibrations", *bad) for bad in BAD_RIGS],
)
def test_an_invalid_document_is_rejected_with_the_field(
    service: Service, path: str, body: Any, loc: list[str | int]
) -> None:
    answer = service.client.post(path, json=body)
    problem = problem_of(answer, 422)
    assert problem["errors"][0]["loc"] == loc
    assert set(problem["errors"][0]) == {"loc", "msg", "type"}
    assert MARKER not in answer.text


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_json_has_not_are_refused(service: Service, number: str) -> None:
    text = json.dumps(with_(RIG, 123456.5, "left", "focal_length_mm")).replace("123456.5", number)
    answer = service.client.post(
        "/v1/calibrations", content=text, headers={"Content-Type": "application/json"}
    )
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["body", "left", "focal_length_mm"]


@pytest.mark.parametrize(
    ("field", "loc"),
    [
        ("focal_length_mm", ["body", "left", "focal_length_mm"]),
        (f"<{MARKER}>", ["body", "left", "(unprintable)"]),
    ],
)
def test_a_field_given_twice_is_refused(service: Service, field: str, loc: list[str]) -> None:
    text = json.dumps(RIG).replace('"left": {', f'"left": {{"{field}": 7.5, "{field}": 7.6, ', 1)
    answer = service.client.post(
        "/v1/calibrations", content=text, headers={"Content-Type": "application/json"}
    )
    error = problem_of(answer, 422)["errors"][0]
    assert error["loc"] == loc
    assert "twice" in error["msg"]
    assert MARKER not in answer.text


@pytest.mark.parametrize("text", ["{", "", "\x00", '{"reference": "' + MARKER, "[" * 50_000, "\ud800"])
def test_what_is_not_json_is_refused(service: Service, text: str) -> None:
    content = text.encode("utf-8", "surrogatepass")
    answer = service.client.post(
        "/v1/surgeries", content=content, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code in {400, 422}
    problem_of(answer, answer.status_code)
    assert MARKER not in answer.text


@pytest.mark.parametrize("kind", [None, "text/plain", "application/xml", "multipart/form-data; boundary=x"])
@pytest.mark.parametrize("path", ["/v1/surgeries", "/v1/calibrations"])
def test_a_document_must_say_that_it_is_json(service: Service, path: str, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    answer = service.client.post(path, content=json.dumps(SURGERY).encode(), headers=headers)
    assert code_of(answer, 415) == "unsupported-media-type"
    assert answer.headers["accept"] == "application/json"


@pytest.mark.parametrize("kind", [None, "application/json", "application/x-www-form-urlencoded"])
def test_a_stage_must_be_a_multipart_form(service: Service, surgery: str, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    answer = service.client.post(f"/v1/surgeries/{surgery}/stages", content=b"name=PRE", headers=headers)
    assert code_of(answer, 415) == "unsupported-media-type"


@pytest.mark.parametrize("kind", ["multipart/form-data", "multipart/form-data; boundary=x"])
def test_a_broken_form_is_a_problem(service: Service, surgery: str, kind: str) -> None:
    answer = service.client.post(
        f"/v1/surgeries/{surgery}/stages", content=b"--x\r\nbroken", headers={"Content-Type": kind}
    )
    assert answer.status_code in {400, 422}
    problem_of(answer, answer.status_code)


@pytest.mark.parametrize(
    "path", ["/v1", "/v1/nothing", "/assets/nothing.js", "/docs/assets/nothing.js", "/v1/surgeries/x/y"]
)
def test_an_unknown_path(service: Service, path: str) -> None:
    assert code_of(service.client.get(path), 404) == "not-found"


@pytest.mark.parametrize(
    ("method", "path", "allow"),
    [
        ("DELETE", "/v1/surgeries", "GET, HEAD, POST"),
        ("PUT", "/v1/calibrations", "GET, HEAD, POST"),
        ("PATCH", "/v1/surgeries/x", "DELETE, GET, HEAD"),
        ("DELETE", "/v1/surgeries/x/stages", "GET, HEAD, POST"),
        ("POST", "/v1/jobs/x", "GET, HEAD"),
        ("GET", "/v1/jobs/x/cancel", "POST"),
        ("HEAD", "/v1/jobs/x/cancel", "POST"),
    ],
)
def test_a_wrong_method_is_answered_with_the_allowed_ones(
    service: Service, method: str, path: str, allow: str
) -> None:
    answer = service.client.request(method, path)
    if method == "HEAD":
        assert (answer.status_code, answer.content) == (405, b"")
    else:
        assert code_of(answer, 405) == "method-not-allowed"
    assert answer.headers["allow"] == allow


@pytest.mark.parametrize(
    "path", ["/v1/calibrations", "/v1/surgeries", "/v1/jobs/none", "/openapi.json", "/docs"]
)
def test_head_is_get_without_its_body(service: Service, path: str) -> None:
    plain = {"Accept-Encoding": "identity"}
    got, head = service.client.get(path, headers=plain), service.client.head(path, headers=plain)
    assert head.status_code == got.status_code
    assert head.content == b""
    assert head.headers["content-type"] == got.headers["content-type"]
    assert head.headers["content-length"] == str(len(got.content))
    wait_for(lambda: service.logged("HEAD", path), "the line of the log")


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("/v1/calibrations/none", "calibration-not-found"),
        ("/v1/surgeries/none", "surgery-not-found"),
        ("/v1/surgeries/none/stages", "surgery-not-found"),
        ("/v1/surgeries/none/stages/PRE", "surgery-not-found"),
        ("/v1/surgeries/none/stages/PRE/triads", "surgery-not-found"),
        ("/v1/surgeries/none/motion?from=A&to=B", "surgery-not-found"),
    ],
)
def test_what_does_not_exist_is_named(service: Service, path: str, code: str) -> None:
    assert code_of(service.client.get(path), 404) == code


def test_a_stage_that_does_not_exist(service: Service, surgery: str) -> None:
    for part in ("", "/triads", "/features", "/images/left"):
        answer = service.client.get(f"/v1/surgeries/{surgery}/stages/NONE{part}")
        assert code_of(answer, 404) == "stage-not-found"
    wrong_side = service.client.get(f"/v1/surgeries/{surgery}/stages/NONE/images/middle")
    assert code_of(wrong_side, 422) == "invalid-request"


@pytest.mark.parametrize(
    "query",
    [
        "limit=0",
        "limit=201",
        "limit=x",
        "offset=0",
        "sort=age",
        "state=lost",
        "created_after=noon",
    ],
)
def test_a_page_out_of_bounds(service: Service, query: str) -> None:
    assert code_of(service.client.get(f"/v1/surgeries?{query}"), 422) == "invalid-request"


def test_a_request_keeps_its_identifier(service: Service) -> None:
    answer = service.client.get("/v1/jobs/none", headers={"X-Request-ID": "cart-7_1"})
    assert answer.headers["x-request-id"] == "cart-7_1"
    assert answer.json()["instance"] == "urn:spinewatch:request:cart-7_1"
    hostile = service.client.get("/v1/jobs/none", headers={"X-Request-ID": "a b;c"})
    assert hostile.headers["x-request-id"] != "a b;c"


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service that takes 100 kB at most."""
    with Service(tmp_path_factory.mktemp("small"), SPINEWATCH_MAX_UPLOAD_BYTES="100000") as service:
        yield service


JSON = {"Content-Type": "application/json"}


def text_of(length: int) -> bytes:
    return json.dumps(SURGERY).ljust(length).encode()


@pytest.mark.parametrize(
    ("path", "limit"),
    [("/v1/surgeries", 65_536), ("/v1/calibrations", 262_144), ("/v1/surgeries/x/spine", 262_144)],
)
def test_a_body_that_says_it_is_too_large(service: Service, path: str, limit: int) -> None:
    method = "PUT" if path.endswith("spine") else "POST"
    answer = service.client.request(method, path, content=text_of(limit + 1), headers=JSON)
    assert code_of(answer, 413) == "content-too-large"
    assert str(limit) in answer.json()["detail"]


def test_a_path_that_does_not_exist_is_not_judged_by_its_body(service: Service) -> None:
    answer = service.client.post("/v1/nothing", content=text_of(1_000_000), headers=JSON)
    assert code_of(answer, 404) == "not-found"


@pytest.mark.parametrize("path", ["/v1/surgeries", "/v1/surgeries/none/stages"])
def test_chunks_that_become_too_large(small: Service, path: str) -> None:
    part = b'--x\r\nContent-Disposition: form-data; name="left"; filename="left"\r\n\r\n'

    def chunks() -> Iterator[bytes]:
        yield part if path.endswith("stages") else b"{"
        for _ in range(15):
            yield b" " * 10_000

    kind = "multipart/form-data; boundary=x" if path.endswith("stages") else "application/json"
    answer = small.client.post(path, content=chunks(), headers={"Content-Type": kind})
    problem_of(answer, 413)


def test_a_stage_that_is_too_large_leaves_nothing(small: Service) -> None:
    surgery, calibration = small.surgery(), small.calibration()
    assert sum(map(len, pair("PRE"))) > 100_000
    problem_of(small.send(surgery, "PRE", pair("PRE"), calibration), 413)
    assert small.sql("SELECT count(*) FROM images") == [(0,)]
    assert small.client.get("/v1/health").status_code == 200


def test_a_body_at_the_limit_is_taken(service: Service) -> None:
    answer = service.client.post("/v1/surgeries", content=text_of(65_536), headers=JSON)
    assert answer.status_code == 201


def change(service: Service, statement: str, *values: str) -> None:
    run_sql(service.database_url, statement, *values, commit=True)


def test_an_unexpected_error_is_a_problem_and_is_logged(small: Service) -> None:
    surgery = small.surgery()
    change(small, "UPDATE surgeries SET vertebrae = '{}' WHERE id = ?", surgery)
    answer = small.client.get(f"/v1/surgeries/{surgery}")
    problem = problem_of(answer, 500)
    assert answer.headers["x-request-id"] in problem["detail"]
    assert small.logged("unexpected_error", answer.headers["x-request-id"])
    assert small.logged("Traceback")


def test_a_database_of_another_version_is_a_problem(small: Service) -> None:
    change(small, "UPDATE alembic_version SET version_num = 'other'")
    try:
        assert code_of(small.client.get("/v1/health"), 503) == "database-not-ready"
    finally:
        change(small, "UPDATE alembic_version SET version_num = ?", REVISION)
    assert small.ready()


def test_logs_hold_no_case_number(service: Service) -> None:
    reference = "case-that-must-not-be-logged"
    service.client.post("/v1/surgeries", json={**SURGERY, "reference": reference})
    service.client.get("/v1/surgeries", params={"note": reference})
    assert reference not in service.log.read_text()


def test_what_is_not_http_does_no_harm(service: Service) -> None:
    with socket.create_connection(("127.0.0.1", service.port), timeout=PATIENCE_S) as connection:
        connection.sendall(b"GARBAGE\r\n\r\n")
        assert connection.recv(100).startswith(b"HTTP/1.1 400")
    assert service.ready()


@pytest.mark.parametrize("tag", ['"zzz"', "*"])
def test_nothing_is_done_under_a_condition_that_nobody_compares(idle: Service, tag: str) -> None:
    surgery = idle.surgery()
    for method, path in (("DELETE", ""), ("GET", ""), ("POST", "/spine/computations")):
        answer = idle.client.request(method, f"/v1/surgeries/{surgery}{path}", headers={"If-Match": tag})
        assert code_of(answer, 412) == "precondition-failed"
    assert idle.client.get(f"/v1/surgeries/{surgery}").status_code == 200
