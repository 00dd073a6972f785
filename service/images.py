"""Pictures as they were sent: what is told of them, and the files themselves."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Header, Response
from pydantic import Field
from sqlalchemy.orm import Session

from contract.base import Schema
from service.dependencies import problems
from store import images
from store.tables import Image

Side = Literal["left", "right"]


class ImageDocument(Schema):
    """A picture as it was sent."""

    sha256: Annotated[str, Field(description="SHA-256 of the file, hexadecimal.")]
    media_type: Annotated[str, Field(examples=["image/png"])]
    width_px: int
    height_px: int
    size_bytes: int

    @classmethod
    def of(cls, row: Image) -> ImageDocument:
        """Return the document of a row."""
        return cls(
            sha256=row.sha256,
            media_type=row.media_type,
            width_px=row.width,
            height_px=row.height,
            size_bytes=row.size_bytes,
        )


class PairDocument(Schema):
    """Both pictures."""

    left: ImageDocument
    right: ImageDocument

    @classmethod
    def of(cls, left: Image, right: Image) -> PairDocument:
        """Return the document of both rows."""
        return cls(left=ImageDocument.of(left), right=ImageDocument.of(right))


IfNoneMatch = Annotated[str | None, Header()]
FILE_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {"content": {"image/*": {"schema": {"type": "string", "format": "binary"}}}},
    304: {"description": "The picture is the one in If-None-Match."},
    **problems(404, 422),
}


def file_response(session: Session, image: Image, if_none_match: str | None) -> Response:
    """Return the original file; its ETag is its SHA-256."""
    headers = {"ETag": f'"{image.sha256}"', "X-Content-Type-Options": "nosniff"}
    if if_none_match and image.sha256 in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(images.content(session, image.sha256), media_type=image.media_type, headers=headers)
