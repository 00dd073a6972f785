import os
from collections.abc import Callable
from pathlib import Path

import pytest

from commands.shared.files import (
    InputError,
    OutputError,
    make_folder,
    printable_name,
    read_bytes,
    read_image,
    read_json,
    read_text,
    require_ending,
    write_bytes,
    write_text,
)


def test_text_is_written_and_read_in_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "text"
    write_text(path, "Wirbelsäule\n")
    assert read_text(path) == "Wirbelsäule\n"
    assert read_bytes(path) == "Wirbelsäule\n".encode()


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "missing", tmp_path):
        with pytest.raises(InputError, match=f"cannot read {path}: "):
            read_bytes(path)


@pytest.mark.parametrize("read", [read_bytes, read_text, read_json, read_image])
def test_a_file_that_is_too_large_or_never_ends_is_not_read(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 6 << 30)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="it has more than"):
        read(tmp_path / "large")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        with pytest.raises(InputError, match="device, pipe or socket"):
            read(path)


def test_a_file_that_is_not_text_is_named(tmp_path: Path) -> None:
    path = tmp_path / "binary"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=f"{path} is not a text file"):
        read_text(path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000])
def test_a_file_that_is_not_json_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(InputError, match=f"{path} is not JSON"):
        read_json(path)
    path.write_text('{"a": 1}')
    assert read_json(path) == {"a": 1}


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "file"
    with pytest.raises(OutputError, match=f"cannot write {path}: "):
        write_text(path, "")
    make_folder(path.parent)
    make_folder(path.parent)
    write_bytes(path, b"content")
    with pytest.raises(OutputError, match=f"cannot create {path / 'below'}: "):
        make_folder(path / "below")


def test_a_name_that_is_not_utf_8_is_escaped() -> None:
    assert printable_name("Wirbelsäule") == "Wirbelsäule"
    assert printable_name(os.fsdecode(b"shot-\xff")) == "shot-\\xff"


def test_an_ending_says_what_a_file_holds(tmp_path: Path) -> None:
    for name in ("r.html", "R.HTM"):
        require_ending(tmp_path / name, (".html", ".htm"), "a report")
    require_ending(Path("/dev/null"), (".html",), "a report")
    require_ending(tmp_path / "rig", (".json", ""), "a rig")
    with pytest.raises(OutputError, match=r"cannot hold a rig"):
        require_ending(tmp_path / ("x" * 300), (".json",), "a rig")
    with pytest.raises(OutputError, match=r"r.docx cannot hold a report; give a name with .html or .htm"):
        require_ending(tmp_path / "r.docx", (".html", ".htm"), "a report")
    with pytest.raises(OutputError, match=r".json or no ending"):
        require_ending(tmp_path / "rig.foo", (".json", ""), "a rig")
