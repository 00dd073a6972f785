import numpy as np
import pytest

from spinewatch.array_file import reading_arrays, write_arrays
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
