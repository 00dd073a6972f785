"""Uploaded images."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema


class Image(Schema):
    """An image file as it is stored: as it was sent, without metadata."""

    sha256: Annotated[str, Field(description="SHA-256 of the file, hexadecimal.")]
    media_type: Annotated[str, Field(description="Media type of the file.", examples=["image/png"])]
    width_px: Annotated[int, Field(description="Width, px.")]
    height_px: Annotated[int, Field(description="Height, px.")]
    size_bytes: Annotated[int, Field(description="Size of the file, bytes.")]


class ImagePair(Schema):
    """Both images of a stereo pair."""

    left: Annotated[Image, Field(description="The left image.")]
    right: Annotated[Image, Field(description="The right image.")]
