import gzip
import re
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from service.dashboard_page import DashboardMissingError, install, read_files
from service.middleware.compression import Compression
from service.middleware.head import Head
from tests.service.middleware.asgi import request

SCRIPT = "text" * 1000


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<!doctype html>")
    (tmp_path / "icon.svg").write_text("<svg/>")
    (tmp_path / "assets" / "main.js").write_text(SCRIPT)
    (tmp_path / "assets" / "main.css").write_text("a{}")
    (tmp_path / "assets" / "notes.txt").write_text("not sent")
    return tmp_path


@pytest.fixture
def app(folder: Path) -> FastAPI:
    app = FastAPI()
    install(app, folder)
    app.add_middleware(Compression)
    app.add_middleware(Head)
    return app


def get(app: FastAPI, path: str, **headers: str) -> httpx.Response:
    return request(app, "GET", path, headers={"Accept-Encoding": "identity", **headers})


@pytest.mark.parametrize(
    ("path", "media_type"),
    [
        ("/", "text/html; charset=utf-8"),
        ("/icon.svg", "image/svg+xml"),
        ("/assets/main.js", "text/javascript; charset=utf-8"),
        ("/assets/main.css", "text/css; charset=utf-8"),
    ],
)
def test_each_file_has_its_media_type(app: FastAPI, path: str, media_type: str) -> None:
    answer = get(app, path)
    assert (answer.status_code, answer.headers["content-type"]) == (200, media_type)
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["referrer-policy"] == "no-referrer"
    head = request(app, "HEAD", path, headers={"Accept-Encoding": "identity"})
    assert (head.headers["etag"], head.content) == (answer.headers["etag"], b"")


@pytest.mark.parametrize("path", ["/index.html", "/assets/notes.txt", "/assets/", "/assets/../index.html"])
def test_nothing_else_is_sent(app: FastAPI, path: str) -> None:
    assert get(app, path).status_code == 404


def test_only_files_of_the_service_run(app: FastAPI) -> None:
    policy = get(app, "/").headers["content-security-policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["script-src"] == rules["style-src"] == rules["connect-src"] == "'self'"
    assert rules["frame-ancestors"] == rules["base-uri"] == "'none'"
    assert "unsafe" not in policy
    assert "http" not in policy
    assert "*" not in policy


def test_a_browser_asks_whether_it_has_the_newest_one(app: FastAPI) -> None:
    answer = get(app, "/assets/main.js")
    assert answer.headers["cache-control"] == "no-cache"
    again = get(app, "/assets/main.js", **{"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert get(app, "/assets/main.js", **{"If-None-Match": '"other"'}).status_code == 200


def test_files_are_compressed_for_those_who_take_it(app: FastAPI) -> None:
    plain = get(app, "/assets/main.js")
    answer = get(app, "/assets/main.js", **{"Accept-Encoding": "br, gzip"})
    assert "content-encoding" not in plain.headers
    assert answer.headers["content-encoding"] == "gzip"
    assert answer.headers["vary"] == plain.headers["vary"] == "Accept-Encoding"
    assert int(answer.headers["content-length"]) < 100
    assert answer.text == plain.text == SCRIPT
    assert answer.headers["etag"] == f"W/{plain.headers['etag']}"
    again = get(
        app, "/assets/main.js", **{"Accept-Encoding": "gzip", "If-None-Match": answer.headers["etag"]}
    )
    assert again.status_code == 304


def test_a_refused_encoding_is_not_used(app: FastAPI) -> None:
    answer = get(app, "/assets/main.js", **{"Accept-Encoding": "gzip;q=0"})
    assert answer.text == SCRIPT


def test_the_compressed_form_is_the_same_every_time(folder: Path) -> None:
    first, second = (read_files(folder)["/assets/main.js"] for _ in range(2))
    assert first.compressed == second.compressed
    assert gzip.decompress(first.compressed) == first.content


def test_an_installation_without_the_page_says_so(tmp_path: Path) -> None:
    with pytest.raises(DashboardMissingError, match="make web"):
        install(FastAPI(), tmp_path)


def test_the_committed_page_is_complete() -> None:
    files = read_files()
    named = re.findall(r'(?:src|href)="(/[^"]+)"', files["/"].content.decode())
    assert any(path.endswith(".js") for path in named)
    assert set(named) <= {*files, "/docs"}
