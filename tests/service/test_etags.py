import hashlib

import pytest

from contract.stage_reference import StageReference
from service.etags import document_response, tagged_response

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
