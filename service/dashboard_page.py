"""The dashboard: the built files of ``web/``, which the service sends to browsers at ``/``."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

from fastapi import FastAPI, Header, Response

from service.etags import etag_matches
from spinewatch.errors import SpinewatchError

FOLDER = Path(__file__).parent / "dashboard"
"""The built files; ``make web`` writes them."""

_INDEX = "index.html"
MEDIA_TYPES: Mapping[str, str] = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
"""Media types of the files that are sent, by the end of their names."""

_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob: data:",
        "connect-src 'self'",
        "font-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=(), usb=()",
    # file names stay the same in the next version: a browser asks whether it has the newest one
    "Cache-Control": "no-cache",
}
"""Headers of every file of the dashboard."""


class DashboardMissingError(SpinewatchError):
    """The built files of the dashboard are not there."""

    code = "dashboard-missing"


@dataclass(frozen=True)
class PageFile:
    """A file of the dashboard, as it is sent.

    Attributes
    ----------
    content
        The file.
    media_type
        Its media type.
    """

    content: bytes
    media_type: str

    @cached_property
    def tag(self) -> str:
        """The entity tag, without quotes."""
        return hashlib.sha256(self.content).hexdigest()

    @cached_property
    def compressed(self) -> bytes:
        """The content in gzip format; the same bytes every time."""
        return gzip.compress(self.content, compresslevel=9, mtime=0)


def read_files(folder: Path = FOLDER) -> Mapping[str, PageFile]:
    """Return the files of the dashboard.

    Parameters
    ----------
    folder
        Where they lie.

    Returns
    -------
    Mapping
        The files by the path at which they are sent; the page itself at ``/``.

    Raises
    ------
    DashboardMissingError
        There is no page in the folder.
    """
    if not (folder / _INDEX).is_file():
        raise DashboardMissingError(
            f"the page is missing in {folder}; install the package again, or run `make web`"
        )
    files = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix in MEDIA_TYPES:
            name = path.relative_to(folder).as_posix()
            files["/" if name == _INDEX else f"/{name}"] = PageFile(
                path.read_bytes(), MEDIA_TYPES[path.suffix]
            )
    return files


def install(app: FastAPI, folder: Path = FOLDER) -> None:
    """Send the dashboard at ``/``, and each of its files at its path.

    Parameters
    ----------
    app
        The application.
    folder
        Where the files lie.

    Raises
    ------
    DashboardMissingError
        There is no page in the folder.
    """
    for path, file in read_files(folder).items():
        add_file(app, path, file)


def add_file(app: FastAPI, path: str, file: PageFile) -> None:
    """Send a file at a path.

    Parameters
    ----------
    app
        The application.
    path
        Path of the URL.
    file
        The file.
    """

    def send(
        if_none_match: Annotated[str | None, Header()] = None,
        accept_encoding: Annotated[str, Header()] = "",
    ) -> Response:
        return _response(file, if_none_match, accept_encoding)

    app.add_api_route(path, send, include_in_schema=False, response_class=Response)


def _response(file: PageFile, if_none_match: str | None, accept_encoding: str) -> Response:
    """Return a file, compressed for those who take that, or 304 for those who have it."""
    is_compressed = _takes_gzip(accept_encoding) and len(file.compressed) < len(file.content)
    # one tag for both forms would be wrong for a strong one (RFC 9110, 8.8.3)
    tag = f'W/"{file.tag}"' if is_compressed else f'"{file.tag}"'
    headers = {**HEADERS, "ETag": tag}
    if is_compressed:
        headers["Vary"] = "Accept-Encoding"  # the middleware that compresses adds it to other answers
    if etag_matches(if_none_match, f'"{file.tag}"'):
        return Response(status_code=304, headers=headers)
    if is_compressed:
        headers["Content-Encoding"] = "gzip"
    content = file.compressed if is_compressed else file.content
    return Response(content, media_type=file.media_type, headers=headers)


def _takes_gzip(accept_encoding: str) -> bool:
    """Return whether gzip is among the encodings that a client accepts, and not with the weight 0."""
    for item in accept_encoding.lower().split(","):
        name, _, weight = item.partition(";")
        if name.strip() == "gzip":
            return weight.replace(" ", "") not in {"q=0", "q=0.0", "q=0.00", "q=0.000"}
    return False
