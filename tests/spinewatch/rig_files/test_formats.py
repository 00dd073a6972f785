from typing import get_args

import numpy as np
import pytest

from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.formats import RIG_FILE_NAMES, format_rig_files, parse_rig_files
from spinewatch.rig_files.rig_json import rig_to_dict
from spinewatch.simulation.rigs import large_rig

FORMATS: tuple[RigFormat, ...] = get_args(RigFormat)


def test_every_format_has_file_names() -> None:
    assert tuple(RIG_FILE_NAMES) == FORMATS


@pytest.mark.parametrize("rig_format", FORMATS)
def test_round_trip_projects_alike_within_the_stated_errors(rig_format: RigFormat) -> None:
    rig = large_rig()
    texts, out_px = format_rig_files(rig, rig_format)
    assert tuple(texts) == RIG_FILE_NAMES[rig_format]
    back, in_px = parse_rig_files(
        texts,
        rig_format,
        name=rig.name,
        image_size_px=rig.left.image_size_px,
        pixel_size_mm=rig.left.pixel_size_mm,
    )
    assert back.name == rig.name
    X = np.random.default_rng(0).uniform((390, 360, 60), (480, 420, 120), (30, 3))
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert np.abs(again.project(X) - camera.project(X)).max() <= 1.5 * (out_px + in_px) + 1e-4


def test_json_is_exact_and_keeps_its_own_name() -> None:
    rig = large_rig()
    texts, out_px = format_rig_files(rig, "json")
    back, in_px = parse_rig_files(texts, "json", name="other", image_size_px=(1, 1), pixel_size_mm=(1.0, 1.0))
    assert rig_to_dict(back) == rig_to_dict(rig)
    assert out_px == in_px == 0
