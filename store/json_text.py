"""JSON for columns: from values, or as text that was made before."""

from __future__ import annotations

import json
from typing import Any


class JsonText(str):
    """JSON of a value of a column, which is stored as it is."""

    __slots__ = ()


def to_json(value: Any) -> str:
    """Return the JSON of a value of a column.

    Parameters
    ----------
    value
        The value, or its JSON.

    Returns
    -------
    str
        JSON without spaces.

    Raises
    ------
    ValueError
        A number is not finite.
    """
    return str(value) if isinstance(value, JsonText) else _encode(value)


_encode = json.JSONEncoder(allow_nan=False, separators=(",", ":")).encode
