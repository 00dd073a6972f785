import pytest
from pydantic import ValidationError

from contract.image import Image, ImagePair

IMAGE = {"sha256": "0" * 64, "media_type": "image/png", "width_px": 568, "height_px": 416, "size_bytes": 9}


def test_a_pair_has_both_images() -> None:
    pair = ImagePair(left=Image(**IMAGE), right=Image(**IMAGE))  # type: ignore[arg-type]
    assert pair.model_dump() == {"left": IMAGE, "right": IMAGE}
    with pytest.raises(ValidationError):
        ImagePair.model_validate({"left": IMAGE})
