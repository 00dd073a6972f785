import asyncio
import hashlib
from io import BytesIO

import pytest
from fastapi.responses import StreamingResponse

from contract.stage_reference import StageReference
from service.etags import document_response, tagged_file, tagged_response

DOCUMENT = StageReference(name="PRE", take=1, calibration_id="c")
TEXT = DOCUMENT.model_dump_json()
TAG = f'"{hashlib.sha256(TEXT.encode()).hexdigest()}"'


def test_a_document_has_a_strong_tag_of_its_bytes() -> None:
    for document in (DOCUMENT, TEXT):
        response = document_response(document, None)
        assert response.status_code == 200
        assert response.body == TEXT.encode()
        assert response.headers["content-type"] == "application/json"
        assert response.headers["etag"] == TAG
        assert response.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize("sent", [TAG, f"W/{TAG}", f'"a", {TAG}', f'W/"a",W/{TAG} , "b"', "*", f" {TAG} "])
def test_who_has_the_document_gets_no_body(sent: str) -> None:
    response = document_response(DOCUMENT, sent)
    assert (response.status_code, response.body) == (304, b"")
    assert response.headers["etag"] == TAG


@pytest.mark.parametrize("sent", [None, "", '"a"', TAG.strip('"'), TAG[:-2] + '"', "W/*"])
def test_who_has_another_one_gets_it(sent: str | None) -> None:
    assert document_response(DOCUMENT, sent).status_code == 200


def test_a_file_keeps_its_headers() -> None:
    for sent, status in ((None, 200), ("*", 304)):
        response = tagged_response(b"x", "model/gltf-binary", sent, {"Content-Disposition": "attachment"})
        assert response.status_code == status
        assert response.headers["content-disposition"] == "attachment"


def test_the_rest_of_a_file_is_sent_in_parts_and_the_file_is_closed() -> None:
    content = bytes(range(256)) * 4096
    file = BytesIO(b"a line\n" + content)
    file.readline()
    response = tagged_file(file, "abc", "model/gltf-binary", '"other"', {"Content-Length": "1048576"})
    assert isinstance(response, StreamingResponse)

    async def parts() -> list[bytes]:
        return [bytes(part) async for part in response.body_iterator if isinstance(part, bytes)]

    found = asyncio.run(parts())
    assert len(found) > 1
    assert b"".join(found) == content
    assert response.headers["etag"] == '"abc"'
    assert response.headers["content-length"] == "1048576"
    assert file.closed


def test_who_has_a_file_gets_no_body() -> None:
    file = BytesIO(b"x")
    response = tagged_file(file, "abc", "model/gltf-binary", 'W/"abc"', {"Content-Length": "1"})
    assert (response.status_code, response.body) == (304, b"")
    assert response.headers["etag"] == '"abc"'
    assert "content-length" not in response.headers
    assert file.closed
