from pathlib import Path

import pytest

from store.errors import ExportFileError
from store.private_file import private_file


def test_a_file_appears_whole_and_for_its_owner_alone(tmp_path: Path) -> None:
    file = tmp_path / "x"
    with private_file(file) as stream:
        stream.write(b"content")
        assert not file.exists()
    assert file.read_bytes() == b"content"
    assert file.stat().st_mode & 0o777 == 0o600
    assert list(tmp_path.iterdir()) == [file]


def test_a_file_that_fails_is_not_there(tmp_path: Path) -> None:
    def write() -> None:
        with private_file(tmp_path / "x") as stream:
            stream.write(b"content")
            raise KeyError

    with pytest.raises(KeyError):
        write()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["there", "dangling", "none/x", "there/x"])
def test_a_file_that_cannot_be_made_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "there").write_bytes(b"old")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    with pytest.raises(ExportFileError, match=r"choose another"), private_file(tmp_path / name):
        pass
    assert (tmp_path / "there").read_bytes() == b"old"
