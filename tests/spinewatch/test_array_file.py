import io
import zipfile

import numpy as np
import pytest

from spinewatch.array_file import LARGEST_BYTES, reading_arrays, write_arrays
from spinewatch.errors import SpinewatchError

ERROR = SpinewatchError("not a file of arrays; write one")


def test_arrays_and_description_survive_their_file() -> None:
    arrays = {"a": np.arange(6, dtype=np.float16).reshape(2, 3), "b": np.array([True, False])}
    with reading_arrays(write_arrays({"version": "v", "size": [2, 3]}, arrays), ERROR) as (description, read):
        assert description == {"version": "v", "size": [2, 3]}
        for name, array in arrays.items():
            assert read[name].dtype == array.dtype
            np.testing.assert_array_equal(read[name], array)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a file", write_arrays(None, {})[:-30]])
def test_other_files_are_refused_with_the_given_error(data: bytes) -> None:
    with pytest.raises(SpinewatchError) as caught, reading_arrays(data, ERROR):
        pytest.fail("opened")
    assert caught.value is ERROR


def archive(content: bytes, compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a file of arrays with another array, as these bytes."""
    buffer = io.BytesIO(write_arrays(None, {}))
    with zipfile.ZipFile(buffer, "a", compression) as file:
        file.writestr("a.npy", content)
    return buffer.getvalue()


def array_of(shape: tuple[int, ...]) -> bytes:
    """Return the beginning of an array that states a shape and has no values."""
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "|u1", "fortran_order": False, "shape": shape})
    return buffer.getvalue()


@pytest.mark.parametrize(
    "data",
    [
        archive(bytes(LARGEST_BYTES)),
        archive(array_of((1 << 45,))),
        archive(array_of((1 << 62, 4))),
        archive(array_of((1,)) + b"1", zipfile.ZIP_LZMA),
        archive(array_of((1,)) + b"1", zipfile.ZIP_STORED).replace(b"\x01\x00v", b"\x01\x00w"),
    ],
    ids=["large", "states-much", "states-too-much", "lzma", "checksum"],
)
def test_an_archive_that_is_too_large_or_odd_is_refused_with_the_given_error(data: bytes) -> None:
    with pytest.raises(SpinewatchError) as caught, reading_arrays(data, ERROR) as (_, arrays):
        arrays["a"]
    assert caught.value is ERROR


def test_an_array_that_is_missing_is_refused_with_the_given_error() -> None:
    with (
        pytest.raises(SpinewatchError) as caught,
        reading_arrays(write_arrays(None, {}), ERROR) as (_, arrays),
    ):
        arrays["weights"]
    assert caught.value is ERROR


def test_objects_are_not_unpickled() -> None:
    data = write_arrays(None, {"evil": np.array([{"a": 1}], dtype=object)})
    with pytest.raises(SpinewatchError), reading_arrays(data, ERROR) as (_, arrays):
        arrays["evil"]
