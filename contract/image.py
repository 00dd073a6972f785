"""Uploaded images."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema


class Image(Schema):
    """An image file as it was sent."""

    sha256: Annotated[str, Field(description="SHA-256 of the file, hexadecimal.")]
    media_type: Annotated[str, Field(examples=["image/png"])]
    width_px: int
    height_px: int
    size_bytes: int


class ImagePair(Schema):
    """Both images of a stereo pair."""

    left: Image
    right: Image
