"""Uploaded images in responses: their description, and the files themselves."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Path, Response
from fastapi.responses import StreamingResponse

from contract.image import Image, ImagePair
from service.dependencies import problems
from service.etags import NOT_MODIFIED, etag_matches
from store import images, tables
from store.database import Database

SidePath = Annotated[Literal["left", "right"], Path(description="The view: left or right.")]
FILE_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "content": {
            media_type: {"schema": {"type": "string", "format": "binary"}}
            for media_type in ("image/jpeg", "image/png", "image/tiff", "image/x-sun-raster")
        }
    },
    **NOT_MODIFIED,
    **problems(404, 422),
}


_Row = tables.images.Image | images.StoredImage


def image_pair(left: _Row, right: _Row) -> ImagePair:
    """Return the model of two rows."""
    return ImagePair(left=image_of(left), right=image_of(right))


def file_response(database: Database, image: tables.images.Image, if_none_match: str | None) -> Response:
    """Return the stored file with its SHA-256 as the ETag, or 304 if the client has it.

    A large one is read part by part as the client reads it: what many clients do not read is not in memory. To be
    called when no session is open: of requests that wait for a second connection, none would give up its first.
    """
    headers = {"ETag": f'"{image.sha256}"', "X-Content-Type-Options": "nosniff"}
    if etag_matches(if_none_match, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    if image.size_bytes > images.PART_BYTES:
        headers["Content-Length"] = str(image.size_bytes)
        parts = images.checked_parts(database, image)
        return StreamingResponse(parts, media_type=image.media_type, headers=headers)
    with database.read() as session:
        content = images.content(session, image.sha256)
    return Response(content, media_type=image.media_type, headers=headers)


def image_of(row: _Row) -> Image:
    """Return the model of a row."""
    return Image(
        sha256=row.sha256,
        media_type=row.media_type,
        width_px=row.width,
        height_px=row.height,
        size_bytes=row.size_bytes,
    )
