"""Blocks of JPEG compression and jumps of damaged data are seen, and patterns of enlarged images are none."""

import numpy as np
import pytest
from PIL import Image

from spinewatch.imaging.jpeg_blocks import blockiness, raster_step
from spinewatch.imaging.quality import QualityParameters
from tests.spinewatch.imaging.degraded import jpeg, jumping, sample, whole


def test_blocks_stand_out_the_more_an_image_was_compressed() -> None:
    sound, *compressed = (blockiness(whole(change(sample()))) for change in (np.asarray, jpeg(85), jpeg(20)))
    assert sound < QualityParameters().max_blockiness < compressed[0] < compressed[1]


def test_enlarged_images_have_no_blocks() -> None:
    enlarged = Image.fromarray(whole(sample())).resize((1136, 832), Image.Resampling.BICUBIC)
    assert blockiness(np.asarray(enlarged)) < QualityParameters().max_blockiness


def test_step_in_raster_order_is_found() -> None:
    step, share = raster_step(whole(jumping(sample())))
    assert step == pytest.approx(30, abs=5)
    assert share > 0.8
