import os
from pathlib import Path

import pytest

from store.regular_file import open_regular, read_regular


def test_a_regular_file_is_read_up_to_the_limit(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"1234")
    link = tmp_path / "link"
    link.symlink_to(file)
    assert read_regular(file, 4) == read_regular(link, 100) == b"1234"
    with open_regular(file) as stream:
        assert stream.read() == b"1234"
    with pytest.raises(OSError, match="it has more than 3 bytes"):
        read_regular(file, 3)


def test_of_a_file_that_is_too_large_nothing_is_read(tmp_path: Path) -> None:
    file = tmp_path / "large"
    file.touch()
    os.truncate(file, 1 << 40)
    with pytest.raises(OSError, match="it has more than 1000 bytes"):
        read_regular(file, 1000)


def test_a_file_that_states_no_size_is_read_up_to_the_limit() -> None:
    file = Path("/proc/self/status")
    if not file.exists():
        pytest.skip("this system has no /proc")
    assert read_regular(file, 1 << 20)
    with pytest.raises(OSError, match="it has more than 10 bytes"):
        read_regular(file, 10)


def test_what_is_no_regular_file_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero"), Path("/dev/null")):
        with pytest.raises(OSError, match="device, pipe or socket"):
            open_regular(path)
    for path in (tmp_path, tmp_path / "missing"):
        with pytest.raises(OSError, match=r"Is a directory|No such file"):
            read_regular(path, 10)
