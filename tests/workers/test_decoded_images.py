from __future__ import annotations

import numpy as np
import pytest

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from tests.store.builders import sample_pair
from workers.decoded_images import DecodedImages

LEFT, RIGHT = sample_pair("PRE")
SIZE = decode_image(LEFT).nbytes


def test_an_image_is_decoded_once() -> None:
    images = DecodedImages(2 * SIZE)
    first = images.decoded("left", LEFT)
    np.testing.assert_array_equal(first, decode_image(LEFT))
    assert images.decoded("left", b"") is first


def test_what_is_kept_is_known() -> None:
    images = DecodedImages(2 * SIZE)
    left = images.decoded("left", LEFT)
    found = images.kept(["left", "right"])
    assert list(found) == ["left"]
    assert found["left"] is left


def test_the_image_used_longest_ago_is_given_up() -> None:
    images = DecodedImages(2 * SIZE)
    left = images.decoded("left", LEFT)
    right = images.decoded("right", RIGHT)
    assert images.decoded("left", LEFT) is left
    images.keep("third", right.copy())
    assert images.decoded("left", LEFT) is left
    assert images.decoded("right", RIGHT) is not right


def test_an_image_that_is_kept_twice_counts_once() -> None:
    images = DecodedImages(2 * SIZE)
    left = images.decoded("left", LEFT)
    for _ in range(5):
        images.keep("right", left.copy())
    assert images.decoded("left", LEFT) is left


def test_an_image_that_is_too_large_is_not_kept() -> None:
    images = DecodedImages(SIZE - 1)
    assert images.decoded("left", LEFT) is not images.decoded("left", LEFT)


def test_a_file_that_cannot_be_decoded_is_refused_each_time() -> None:
    images = DecodedImages(SIZE)
    for _ in range(2):
        with pytest.raises(ImageError):
            images.decoded("x", b"no image")
