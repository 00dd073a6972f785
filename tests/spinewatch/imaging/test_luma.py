import numpy as np
import pytest
from PIL import Image

from spinewatch.imaging.luma import LUMA_BGR


def test_the_shares_are_those_of_other_programs() -> None:
    assert sum(LUMA_BGR) == pytest.approx(1)
    colours = np.random.default_rng(1).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    gray = np.asarray(Image.fromarray(colours, "RGB").convert("L"), dtype=float)
    assert np.abs(colours[..., ::-1] @ np.array(LUMA_BGR) - gray).max() < 1
