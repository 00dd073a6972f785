"""Files of arrays (npz without pickles) with a description in JSON: templates and networks."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinewatch.errors import SpinewatchError

_ABOUT = "about"


def write_arrays(about: Any, arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the bytes of a file of named arrays and what they are about."""
    everything: dict[str, Any] = {_ABOUT: np.frombuffer(json.dumps(about).encode(), np.uint8), **arrays}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **everything)
    return buffer.getvalue()


@contextmanager
def reading_arrays(data: bytes, error: SpinewatchError) -> Iterator[tuple[Any, Mapping[str, NDArray[Any]]]]:
    """Give what a file is about and its arrays; raise ``error`` when they, or what is sought in them, are not there."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            yield json.loads(file[_ABOUT].tobytes()), file
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as cause:
        raise error from cause
