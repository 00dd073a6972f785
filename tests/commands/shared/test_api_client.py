import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from commands.shared.api_client import ApiClient, ServiceError, service_client
from commands.shared.files import InputError

Handler = Callable[[httpx.Request], httpx.Response]


def client(handler: Handler) -> ApiClient:
    return ApiClient("http://service/", httpx.MockTransport(handler))


def problem(status: int, body: dict[str, Any]) -> httpx.Response:
    headers = {"Content-Type": "application/problem+json"}
    return httpx.Response(status, content=json.dumps(body), headers=headers)


def test_requests_and_what_they_return(tmp_path: Path) -> None:
    requests: list[httpx.Request] = []

    def handle(request: httpx.Request) -> httpx.Response:
        requests.append(request)
        return httpx.Response(202, json={"id": "x1"}, headers={"Location": "/v1/jobs/j1"})

    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(side.encode())
    with client(handle) as api:
        assert api.add_calibration(b'{"name": "rig"}') == "x1"
        assert api.add_surgery({"reference": "17"}) == "x1"
        stage = api.submit_stage("s1", "PRE", "c1", tmp_path)
        assert api.get("/v1/jobs/j1") == {"id": "x1"}
    assert (stage.name, stage.job_path) == ("PRE", "/v1/jobs/j1")
    assert [(request.method, request.url.path) for request in requests] == [
        ("POST", "/v1/calibrations"),
        ("POST", "/v1/surgeries"),
        ("POST", "/v1/surgeries/s1/stages"),
        ("GET", "/v1/jobs/j1"),
    ]
    assert requests[0].headers["content-type"] == "application/json"
    body = requests[2].content
    assert all(part in body for part in (b'name="left"', b'name="right"', b"c1", b"PRE"))


def test_a_rejected_request_has_the_sentence_of_the_problem() -> None:
    with (
        client(lambda _: problem(409, {"title": "Stage exists", "detail": "choose another name"})) as api,
        pytest.raises(ServiceError, match=r"^GET /v1/x: 409 choose another name$"),
    ):
        api.get("/v1/x")


@pytest.mark.parametrize(
    ("response", "words"),
    [
        (problem(500, {"title": "Internal error"}), "500 Internal error"),
        (httpx.Response(502, text="<html>"), "502 Bad Gateway"),
        (
            httpx.Response(500, text="<html>", headers={"Content-Type": "application/problem+json"}),
            "500 Internal Server Error",
        ),
        (httpx.Response(200, text="<html>"), "none of Spinewatch"),
        (httpx.Response(200, json=[]), "none of Spinewatch"),
    ],
)
def test_a_problem_without_a_sentence(response: httpx.Response, words: str) -> None:
    with client(lambda _: response) as api, pytest.raises(ServiceError, match=words):
        api.get("/v1/x")


def test_a_service_that_cannot_be_reached() -> None:
    def refuse(request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("refused", request=request)

    with client(refuse) as api:
        assert api.instance() is None
        with pytest.raises(ServiceError, match="no answer from http://service: refused"):
            api.get("/v1/x")


@pytest.mark.parametrize(
    "url",
    [
        "http://[::1", "http://127.0.0.1:x", "http://a\x00b", "http://" + 80 * "\xfc", "http://\udcff",
        "http://127.0.0.1/\udcff",
    ],
)  # fmt: skip
def test_what_is_no_url_is_named(url: str) -> None:
    with pytest.raises(ServiceError, match="is no address of a service"):
        service_client(url, 1.0, None, None)


@pytest.mark.parametrize("url", ["", "x", "ftp://x", "http://", f"http://{'a' * 300}", "http://a..b"])
def test_what_leads_to_no_service(url: str) -> None:
    with ApiClient(url) as api:
        assert api.instance() is None
        with pytest.raises(ServiceError, match="no answer from"):
            api.get("/v1/x")


def test_another_program_that_answers_is_no_service(tmp_path: Path) -> None:
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(b"")
    with client(lambda _: httpx.Response(200, json={})) as api:
        with pytest.raises(ServiceError, match="none of Spinewatch"):
            api.add_calibration(b"{}")
        with pytest.raises(ServiceError, match="none of Spinewatch"):
            api.submit_stage("s1", "PRE", "c1", tmp_path)


@pytest.mark.parametrize(
    ("response", "instance"),
    [
        (httpx.Response(200, json={"status": "live", "instance": "mine"}), "mine"),
        (httpx.Response(503, json={"status": "live", "instance": "mine"}), None),
        (httpx.Response(200, text="<html>"), None),
        (httpx.Response(200, json=["another program"]), None),
    ],
)
def test_the_server_names_itself(response: httpx.Response, instance: str | None) -> None:
    with client(lambda _: response) as api:
        assert api.instance() == instance


def test_a_missing_image_is_named_before_anything_is_sent(tmp_path: Path) -> None:
    def fail(request: httpx.Request) -> httpx.Response:
        raise AssertionError(request.url)

    with client(fail) as api, pytest.raises(InputError, match=r"left\.png"):
        api.submit_stage("s1", "PRE", "c1", tmp_path)


def test_the_key_is_sent_with_every_request() -> None:
    sent: list[str | None] = []

    def handle(request: httpx.Request) -> httpx.Response:
        sent.append(request.headers.get("Authorization"))
        return httpx.Response(200, json={})

    with ApiClient("http://service/", httpx.MockTransport(handle), key=" sw_a_b\n") as api:
        api.get("/v1/surgeries")
    with client(handle) as api:
        api.get("/v1/surgeries")
    assert sent == ["Bearer sw_a_b", None]


@pytest.mark.parametrize("key", ["sw_a\nb", "sw_\N{SNOWMAN}", "sw_a\x00b"])
def test_a_key_that_no_header_can_hold_is_refused_and_not_repeated(key: str) -> None:
    with pytest.raises(ServiceError, match="copy it again") as refused:
        ApiClient("http://service/", key=key)
    assert key not in str(refused.value)
