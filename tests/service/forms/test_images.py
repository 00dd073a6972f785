import io

import pytest
from fastapi import UploadFile

from service.forms.images import read_image
from service.problems import InvalidInputError
from tests.paths import SAMPLES

IMAGE = (SAMPLES / "D1" / "PRE" / "left.png").read_bytes()


def test_an_image_keeps_its_bytes_and_has_its_size() -> None:
    image = read_image("left", UploadFile(io.BytesIO(IMAGE)))
    assert image.content == IMAGE
    assert image.header.size == (568, 416)


@pytest.mark.parametrize(
    ("index", "loc", "words"), [(None, ["body", "left"], "left: "), (2, ["body", "left", 2], "left 3: ")]
)
def test_the_error_names_the_file(index: int | None, loc: list[str | int], words: str) -> None:
    with pytest.raises(InvalidInputError) as raised:
        read_image("left", UploadFile(io.BytesIO(b"GIF89a")), index)
    assert raised.value.loc == loc
    assert raised.value.code == "invalid-image"
    assert str(raised.value).startswith(words)
