"""Summaries from a service and from a file, and what is said when they are none."""

from __future__ import annotations

from pathlib import Path

import httpx
import pytest

from commands.shared.api_client import ServiceError
from commands.shared.files import InputError
from commands.shared.summary_source import FileSource, ServiceSource
from exports import json_document
from tests.contract.spine_results import SURGERY, summary


@pytest.mark.parametrize("content", [json_document.export(summary()), summary().model_dump_json().encode()])
def test_a_file_is_given_once_until_it_changes(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "summary.json"
    path.write_bytes(content)
    source = FileSource(path)
    assert source.changed() == summary()
    assert source.changed() is None
    path.write_bytes(content + b"\n")
    assert source.changed() == summary()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "is not JSON"),
        (b"\xff", "UTF-8"),
        (b"[]", "no summary of a surgery"),
        (b'{"summary": null}', "no summary of a surgery"),
        (b'{"surgery_id": NaN}', "no summary of a surgery: "),
    ],
)
def test_a_file_that_is_no_summary(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "summary.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        FileSource(path).changed()
    with pytest.raises(InputError, match="cannot read"):
        FileSource(tmp_path / "missing.json").changed()


def service(answer: httpx.Response | Exception, asked: list[httpx.Request]) -> ServiceSource:
    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        if isinstance(answer, Exception):
            raise answer
        return httpx.Response(304) if "If-None-Match" in request.headers else answer

    return ServiceSource("http://service/", "a/b", httpx.MockTransport(handle), "sw_a_b")


def test_a_service_is_asked_with_the_tag_that_it_gave() -> None:
    asked: list[httpx.Request] = []
    answer = httpx.Response(200, content=summary().model_dump_json(), headers={"ETag": '"t"'})
    source = service(answer, asked)
    found = source.changed()
    assert found is not None
    assert found.surgery_id == SURGERY
    assert source.changed() is None
    assert asked[0].url.raw_path == b"/v1/surgeries/a%2Fb/summary"
    assert asked[1].headers["If-None-Match"] == '"t"'
    assert [request.headers["Authorization"] for request in asked] == ["Bearer sw_a_b"] * 2


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (httpx.Response(404), "404 Not Found"),
        (httpx.Response(200, content=b"{}"), "another version of the summary"),
        (httpx.ConnectError("refused"), "is the service running"),
    ],
)
def test_a_service_that_has_none(answer: httpx.Response | Exception, words: str) -> None:
    with pytest.raises(ServiceError, match=words):
        service(answer, []).changed()


def test_an_identifier_of_any_bytes_is_sent() -> None:
    asked: list[httpx.Request] = []

    def handle(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(404)

    with pytest.raises(ServiceError, match="404"):
        ServiceSource("http://service", "\udcff", httpx.MockTransport(handle)).changed()
    assert asked[0].url.raw_path == b"/v1/surgeries/%FF/summary"
