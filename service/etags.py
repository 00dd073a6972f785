"""JSON documents with an entity tag: a client that has the document already gets 304 without a body."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import IO, Annotated, Any

from fastapi import Header, Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel

from spinewatch.errors import SpinewatchError

IfNoneMatch = Annotated[str | None, Header(description="ETags of the documents that the client has.")]
NOT_MODIFIED: dict[int | str, dict[str, Any]] = {304: {"description": "The ETag is in If-None-Match."}}

_PART_BYTES = 256 * 1024
"""Bytes of a file that are read, compressed and sent at once."""

IfMatch = Annotated[
    str | None,
    Header(description="ETag of the document that is replaced; another one means that it has changed."),
]


class PreconditionFailedError(SpinewatchError):
    """The document has changed since the client read it."""

    code = "precondition-failed"


class PreconditionRequiredError(SpinewatchError):
    """A document would be replaced without knowing what it is."""

    code = "precondition-required"


def tag_of(document: BaseModel) -> str:
    """Return the ETag with which a document is sent."""
    return _tag(document.model_dump_json(by_alias=True).encode())


def require_match(if_match: str | None, current: BaseModel | None) -> None:
    """Raise unless If-Match names the document that is to be replaced; None when there is none yet.

    A tag that was made weak by compression counts as the tag itself.
    """
    if current is None:
        if if_match is not None:
            raise PreconditionFailedError("there is nothing to replace; leave If-Match out to make it")
        return
    if if_match is None:
        raise PreconditionRequiredError(
            "there is one already; GET it, and send its ETag as If-Match so that nobody else's change is lost"
        )
    if not etag_matches(if_match, tag_of(current)):
        raise PreconditionFailedError("it was changed meanwhile; GET it again, and repeat the change on that")


def document_response(document: BaseModel | str, if_none_match: str | None) -> Response:
    """Return a document, a model or JSON text, with a strong ETag of its bytes, or 304 if the client has it."""
    text = document if isinstance(document, str) else document.model_dump_json(by_alias=True)
    return tagged_response(text.encode(), "application/json", if_none_match)


def tagged_response(
    content: bytes, media_type: str, if_none_match: str | None, headers: dict[str, str] | None = None
) -> Response:
    """Return content with a strong ETag of its bytes, or 304 if the client has it."""
    tag = _tag(content)
    all_headers = {**_tag_headers(tag), **(headers or {})}
    if etag_matches(if_none_match, tag):
        return Response(status_code=304, headers=all_headers)
    return Response(content, media_type=media_type, headers=all_headers)


def tagged_file(
    file: IO[bytes], sha256: str, media_type: str, if_none_match: str | None, headers: dict[str, str]
) -> Response:
    """Return the rest of a file part by part, with its hash as a strong ETag, or 304 if the client has it.

    The file is closed in either case. ``headers`` are of the file, its Content-Length among them.
    """
    tag = f'"{sha256}"'
    if etag_matches(if_none_match, tag):
        file.close()
        return Response(status_code=304, headers=_tag_headers(tag))
    return StreamingResponse(_parts(file), media_type=media_type, headers={**_tag_headers(tag), **headers})


def _parts(file: IO[bytes]) -> Iterator[bytes]:
    with file:
        while part := file.read(_PART_BYTES):
            yield part


def _tag_headers(tag: str) -> dict[str, str]:
    return {"ETag": tag, "Cache-Control": "no-cache"}


def _tag(content: bytes) -> str:
    return f'"{hashlib.sha256(content).hexdigest()}"'


def etag_matches(if_none_match: str | None, tag: str) -> bool:
    """Return whether a tag is in If-None-Match by weak comparison (RFC 9110, 13.1.2); no tag of ours has a comma."""
    if if_none_match is None:
        return False
    if if_none_match.strip() == "*":
        return True
    return tag in (item.strip().removeprefix("W/") for item in if_none_match.split(","))
