from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.errors import RigError
from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.formats import RIG_FILE_NAMES, format_rig_files, parse_rig_files
from spinewatch.rig_files.opencv_yaml import format_opencv
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
    content = parse_rig_files(
        texts,
        rig_format,
        name=rig.name,
        image_size_px=rig.left.image_size_px,
        pixel_size_mm=rig.left.pixel_size_mm,
    )
    back, in_px = content.rig, content.fit_error_px
    assert back.name == rig.name
    assert content.warnings == ()
    X = np.random.default_rng(0).uniform((390, 360, 60), (480, 420, 120), (30, 3))
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert np.abs(again.project(X) - camera.project(X)).max() <= 1.5 * (out_px + in_px) + 1e-4


def test_json_is_exact_and_keeps_its_own_name() -> None:
    rig = large_rig()
    texts, out_px = format_rig_files(rig, "json")
    content = parse_rig_files(texts, "json", name="other", image_size_px=None, pixel_size_mm=(1.0, 1.0))
    assert rig_to_dict(content.rig) == rig_to_dict(rig)
    assert out_px == content.fit_error_px == 0


def strongly_distorted() -> Rig:
    rig = large_rig()
    left, right = (replace(camera, radial=(0.004, 6e-4)) for camera in (rig.left, rig.right))
    return Rig("strong", left, right)


@pytest.mark.parametrize("rig_format", ["opencv", "openptv"])
def test_a_distortion_that_cannot_be_carried_over_is_refused_with_the_figure(rig_format: RigFormat) -> None:
    with pytest.raises(RigError, match=r"differs by up to [0-9.]+ px"):
        format_rig_files(strongly_distorted(), rig_format)
    texts = {"opencv": {"": format_opencv(strongly_distorted())[0]}}.get(rig_format)
    if texts is not None:
        with pytest.raises(RigError, match=r"differs by up to [0-9.]+ px"):
            parse_rig_files(
                texts,
                rig_format,
                name="rig",
                image_size_px=None,
                pixel_size_mm=large_rig().left.pixel_size_mm,
            )


@pytest.mark.parametrize("rig_format", FORMATS)
def test_every_format_is_validated_and_may_start_with_a_byte_order_mark(rig_format: RigFormat) -> None:
    rig, pixel = large_rig(), large_rig().left.pixel_size_mm
    for given, exchanged in ((rig, False), (Rig("exchanged", rig.right, rig.left), True)):
        texts = {file: "\ufeff" + text for file, text in format_rig_files(given, rig_format)[0].items()}
        if exchanged:
            with pytest.raises(RigError, match="exchanged"):
                parse_rig_files(texts, rig_format, name="rig", image_size_px=None, pixel_size_mm=pixel)
        else:
            content = parse_rig_files(texts, rig_format, name="rig", image_size_px=None, pixel_size_mm=pixel)
            assert content.rig.baseline_mm == pytest.approx(420)


def test_glass_is_warned_of() -> None:
    texts, _ = format_rig_files(large_rig(), "openptv")
    lines = texts["right.ori"].splitlines()
    texts["right.ori"] = "\n".join([*lines[:-1], "0 0 120"])
    pixel = large_rig().left.pixel_size_mm
    content = parse_rig_files(texts, "openptv", name="rig", image_size_px=None, pixel_size_mm=pixel)
    (warning,) = content.warnings
    assert warning.startswith("right.ori: the glass wall at 120 mm")
