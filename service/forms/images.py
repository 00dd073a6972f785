"""Image files in a form."""

from __future__ import annotations

from typing import Annotated

from fastapi import UploadFile
from pydantic import WithJsonSchema

from service.problems import InvalidInputError
from spinewatch.errors import ImageError
from spinewatch.imaging.header import inspect_image
from spinewatch.imaging.metadata import without_metadata
from store.images import NewImage, digest

File = Annotated[UploadFile, WithJsonSchema({"type": "string", "format": "binary"})]
"""An uploaded file; the API page shows a file chooser for this format."""


def read_image(field: str, upload: UploadFile, index: int | None = None) -> NewImage:
    """Return an uploaded image without metadata, its header checked; ``index`` counts the files of a repeated field.

    Raises ``InvalidInputError``, which names the field, if the file is not an image or is too large.
    """
    content = upload.file.read()
    try:
        header = inspect_image(content)
        stored = without_metadata(content)
    except ImageError as error:
        raise InvalidInputError(field, error, index) from error
    return NewImage(stored, header, None if stored == content else digest(content))
