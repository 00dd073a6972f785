"""JSON that costs more than it says: deep, wide, repeated, of huge numbers, compressed, in other encodings."""

import gzip
import json
import re

import pytest

from service.app import create_app
from settings import Settings
from tests.hostile.attack import JSON, harmless, refused
from tests.http.harness import RIG, Service, code_of

ROUTES = [
    (method.upper(), re.sub(r"\{(?!surgery_id)\w+\}", "none", path).replace("surgery_id", "surgery"))
    for path, operations in create_app(Settings()).openapi()["paths"].items()
    for method, operation in operations.items()
    if "application/json" in operation.get("requestBody", {}).get("content", {})
]
SMALL = {
    "deep arrays": b"[" * 30_000,
    "deep and closed": b"[" * 30_000 + b"]" * 30_000,
    "deep objects": b'{"left":' * 7_000,
    "40 levels": b'{"left":' * 40 + b"1" + b"}" * 40,
    "4,500 unknown keys": json.dumps({f"k{n:04}": 1 for n in range(4_500)}).encode(),
    "one key 4,900 times": b"{" + b",".join([b'"name":1'] * 4_900) + b"}",
    "7,000 keys": b"{" + b",".join(b'"%d":1' % n for n in range(7_000)) + b"}",
    "numbers": json.dumps({"vertebrae": [0] * 4_900}).encode(),
    "objects": json.dumps({"vertebrae": [{}] * 2_400}).encode(),
    "radiographs": json.dumps({"initial": {"kind": "radiographs", "vertebrae": [{}] * 2_400}}).encode(),
    "30 poses of unknown keys": json.dumps(
        {"initial": {"kind": "poses", "poses": [{f"k{n}": 1 for n in range(160)}] * 30}},
        separators=(",", ":"),
    ).encode(),
    "text": json.dumps({"reference": "x" * 60_000}).encode(),
    "long key": json.dumps({"x" * 60_000: 1}).encode(),
    "escapes": b'{"reference":"' + b"\\u00e9" * 10_000 + b'"}',
    "integer": b'{"offset":' + b"9" * 60_000 + b"}",
    "float": b'{"offset":0.' + b"9" * 60_000 + b"}",
    "1e999": b'{"focal_length_mm":1e999}',
    "exponent": b'{"focal_length_mm":1e' + b"9" * 60_000 + b"}",
    "NaN": b'{"focal_length_mm":NaN}',
    "-Infinity": b'{"focal_length_mm":-Infinity}',
    "NUL": b'{"reference":"a\\u0000b"}',
    "half a pair": b'{"reference":"\\ud800"}',
    "open text": b'{"reference":"' + b"\\" * 60_001,
    "blanks": b" " * 65_000,
    "not UTF-8": b'{"reference":"\xff\xfe"}',
    "UTF-16": '{"reference":"x"}'.encode("utf-16"),
    "UTF-32": '{"reference":"x"}'.encode("utf-32"),
    "two documents": b"{}{}",
    "comment": b"/* */{}",
}


@pytest.mark.parametrize(("method", "path"), ROUTES)
@pytest.mark.parametrize("body", SMALL.values(), ids=SMALL)
def test_a_document_within_the_size(
    service: Service, surgery: str, method: str, path: str, body: bytes
) -> None:
    with harmless(service):
        answer = service.client.request(method, path.format(surgery=surgery), content=body, headers=JSON)
    assert len(refused(service, answer).get("errors", ())) <= 20
    assert len(answer.content) < 20_000


@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_many_unknown_keys_at_the_largest_size(
    service: Service, surgery: str, method: str, path: str
) -> None:
    body = json.dumps({**RIG, **{f"{n:x}": 0 for n in range(4_900)}}, separators=(",", ":")).encode()
    with harmless(service):
        answer = service.client.request(method, path.format(surgery=surgery), content=body, headers=JSON)
    assert len(refused(service, answer).get("errors", ())) <= 20


@pytest.mark.parametrize(("method", "path"), ROUTES)
@pytest.mark.parametrize("size", [300_000, 3_300_000, 28_000_000])
def test_a_document_beyond_the_size(
    service: Service, surgery: str, method: str, path: str, size: int
) -> None:
    body = b"{" + b",".join(b'"%08d":1' % n for n in range(size // 13)) + b"}"
    with harmless(service):
        answer = service.client.request(method, path.format(surgery=surgery), content=body, headers=JSON)
    assert code_of(answer, 413) == "content-too-large"


@pytest.mark.parametrize("path", ["/v1/surgeries/{surgery}/stages", "/v1/calibrations/from-images"])
@pytest.mark.parametrize("kind", ["application/json", "application/problem+json", "text/plain"])
def test_28_mb_of_another_media_type(service: Service, surgery: str, path: str, kind: str) -> None:
    with harmless(service):
        answer = service.client.post(
            path.format(surgery=surgery), content=b"[]," * 9_300_000, headers={"Content-Type": kind}
        )
    assert code_of(answer, 415) == "unsupported-media-type"


@pytest.mark.parametrize(
    ("method", "path", "expected"), [("POST", "/v1/nothing", 404), ("PUT", "/v1/surgeries", 405)]
)
def test_28_mb_to_no_route(service: Service, method: str, path: str, expected: int) -> None:
    with harmless(service):
        answer = service.client.request(method, path, content=b"[]," * 9_300_000, headers=JSON)
    assert answer.status_code == expected


@pytest.mark.parametrize("coding", ["gzip", "deflate", "br", "identity, gzip"])
def test_a_compressed_body_is_refused(service: Service, coding: str) -> None:
    body = gzip.compress(b" " * 30_000_000)
    with harmless(service):
        answer = service.client.post(
            "/v1/surgeries", content=body, headers={**JSON, "Content-Encoding": coding}
        )
    assert code_of(answer, 415) == "unsupported-media-type"


@pytest.mark.parametrize("charset", ["utf-16", "latin-1", "x" * 500])
def test_another_charset_is_refused(service: Service, charset: str) -> None:
    kind = {"Content-Type": f"application/json; charset={charset}"}
    assert service.client.post("/v1/surgeries", content=b"{}", headers=kind).status_code == 415


def test_a_field_given_twice_is_named(service: Service) -> None:
    answer = service.client.post(
        "/v1/surgeries", content=b'{"reference": "a", "reference": "b"}', headers=JSON
    )
    (error,) = refused(service, answer)["errors"]
    assert error["loc"] == ["body", "reference"]
    assert "twice" in error["msg"]
