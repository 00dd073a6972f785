import gzip
import re

import httpx
import pytest
from fastapi_offline import FastAPIOffline

from service.api_page import FOLDER_PATH, install
from tests.service.middleware.asgi import request

APP = FastAPIOffline(static_url=FOLDER_PATH)
install(APP)


def get(path: str, encoding: str = "identity") -> httpx.Response:
    return request(APP, "GET", path, headers={"Accept-Encoding": encoding})


def test_what_the_page_names_is_there() -> None:
    named = re.findall(rf'{FOLDER_PATH}/[^"]+', get("/docs").text)
    assert len(named) == 3
    for path in named:
        assert get(path).status_code == 200


@pytest.mark.parametrize(
    ("name", "media_type"),
    [
        ("swagger-ui-bundle.js", "text/javascript"),
        ("swagger-ui.css", "text/css"),
        ("favicon.png", "image/png"),
    ],
)
def test_a_file_has_its_media_type_and_one_compressed_form(name: str, media_type: str) -> None:
    plain = get(f"{FOLDER_PATH}/{name}")
    assert plain.headers["content-type"].startswith(media_type)
    compressed = get(f"{FOLDER_PATH}/{name}", "gzip")
    assert compressed.content == plain.content
    if media_type.startswith("text/"):
        assert int(compressed.headers["content-length"]) < len(gzip.compress(plain.content, 1))


@pytest.mark.parametrize("path", ["/redoc.standalone.js", "/", "", "/../core.py"])
def test_nothing_else_is_sent(path: str) -> None:
    assert get(FOLDER_PATH + path).status_code == 404
