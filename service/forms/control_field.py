"""The control field in a form: a built-in name, or a CSV table as text or as a file."""

from __future__ import annotations

from fastapi import UploadFile

from service.problems import InvalidInputError
from spinewatch.errors import SpinewatchError

_FIELD = "control_field"
_MAX_CSV_BYTES = 64 * 1024
_MAX_NAME_LENGTH = 200
_EXPECTED = "send the points as CSV id,x_mm,y_mm,z_mm in UTF-8"


class ControlFileError(SpinewatchError):
    """The table of a control field is not text or is too long."""

    code = "invalid-control-field"


def read_control_field(part: UploadFile | str) -> tuple[str, str | None]:
    """Return the name of a control field and its CSV text, which is None for a built-in one.

    Raises ``InvalidInputError`` for a table that is too long or is not text.
    """
    if isinstance(part, str):
        return ("control field", _csv_text(part.encode())) if "\n" in part else (part, None)
    name = (part.filename or "control field")[:_MAX_NAME_LENGTH]
    return name, _csv_text(part.file.read(_MAX_CSV_BYTES + 1))


def _csv_text(content: bytes) -> str:
    if len(content) > _MAX_CSV_BYTES:
        raise InvalidInputError(_FIELD, ControlFileError(f"more than {_MAX_CSV_BYTES} bytes; {_EXPECTED}"))
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidInputError(_FIELD, ControlFileError(f"not UTF-8; {_EXPECTED}")) from error
    if "\0" in text:
        raise InvalidInputError(_FIELD, ControlFileError(f"not a text file; {_EXPECTED}"))
    return text
