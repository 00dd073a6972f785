"""ZIP archives."""

from __future__ import annotations

import io
import zipfile

from exports.archive import zip_archive


def test_content_and_order_and_the_same_bytes_again() -> None:
    files = {"b/x.txt": b"one" * 1000, "a.txt": b""}
    content = zip_archive(files)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["b/x.txt", "a.txt"]
        assert {name: archive.read(name) for name in archive.namelist()} == files
    assert len(content) < 500
    assert zip_archive(files) == content
