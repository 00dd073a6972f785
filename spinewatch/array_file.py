"""Files of arrays (npz without pickles) with a description in JSON: templates and networks."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinewatch.errors import SpinewatchError

LARGEST_BYTES = 256 * 1024 * 1024
"""Largest size of all arrays of a file together, bytes, as they are in memory."""

_COMPRESSIONS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})
_MALFORMED = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    MemoryError,  # an array may state any size
    RuntimeError,  # an encrypted archive
    zipfile.BadZipFile,
    zlib.error,
)

_DESCRIPTION = "about"
"""Name of the array that holds the description in files."""


def write_arrays(description: Any, arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays with a description as the contents of a file.

    Parameters
    ----------
    description
        Value that JSON can represent.
    arrays
        Arrays by name; "about" is reserved.

    Returns
    -------
    bytes
        Contents of a compressed npz file.

    Examples
    --------
    >>> data = write_arrays({"version": "1"}, {"mask": np.ones((2, 2))})
    >>> with reading_arrays(data, SpinewatchError("no such file")) as (description, arrays):
    ...     description["version"], float(arrays["mask"].sum())
    ('1', 4.0)
    """
    everything: dict[str, Any] = {
        _DESCRIPTION: np.frombuffer(json.dumps(description).encode(), np.uint8),
        **arrays,
    }
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **everything)
    return buffer.getvalue()


@contextmanager
def reading_arrays(data: bytes, error: SpinewatchError) -> Iterator[tuple[Any, Mapping[str, NDArray[Any]]]]:
    """Open the contents of a file of arrays.

    Parameters
    ----------
    data
        Contents of the file.
    error
        Raised when the file, or what the caller looks up in it within the context, is missing or malformed.

    Yields
    ------
    description : Any
        Description of the arrays.
    arrays : Mapping of str to NDArray
        Arrays by name, read when they are looked up.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
        if sum(entry.file_size for entry in entries) > LARGEST_BYTES:
            raise error
        if any(entry.compress_type not in _COMPRESSIONS for entry in entries):
            raise error
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            yield json.loads(file[_DESCRIPTION].tobytes()), file
    except _MALFORMED as cause:
        raise error from cause
