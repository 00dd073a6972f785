"""ZIP archives that are the same, byte for byte, for the same content."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

_EPOCH = (1980, 1, 1, 0, 0, 0)


def zip_archive(files: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive.

    Parameters
    ----------
    files
        Content of each file by its path, in the order of the archive.

    Returns
    -------
    bytes
        The archive; it holds no time of its making.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in files.items():
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return buffer.getvalue()
