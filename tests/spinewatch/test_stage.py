"""What is asked of a stage, and what is done with what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.errors import ParameterError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.levels import LevelError
from spinewatch.pipeline import StageMeasurer
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.stage import StageMeasurement, StageRequest, relabelled, require_two_images
from spinewatch.triads.known_configuration import KnownConfiguration
from tests.paths import SAMPLES
from tests.stage_images import T7_IN_INTER, sample, without

REQUEST = StageRequest(labels=("L1", "T11", "T9", "T7"), spine_axis="x")


def frames(contents: tuple[bytes, bytes]) -> tuple[Frame, Frame]:
    left, right = (Frame(decode_image(content), side) for content, side in zip(contents, SIDES, strict=True))
    return left, right


def poses(measured: StageMeasurement) -> list[bytes]:
    found = [triad.triad.pose for triad in measured.triads]
    return [pose.covariance.tobytes() + pose.position_mm.tobytes() for pose in found if pose is not None]


@pytest.mark.parametrize(
    "request_", [{"labels": ("L1", "L1")}, {"labels": ("",)}, {"triads": 0}, {"labels": ("L1",), "triads": 2}]
)
def test_a_request_that_contradicts_itself_is_refused(request_: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        StageRequest(**request_)  # type: ignore[arg-type]


def test_names_are_checked_and_spelled_canonically() -> None:
    request = StageRequest(labels=("l1", "T13", "t09"), extra_levels=("T13",))
    assert (request.labels, request.expected) == (("L1", "T13", "T9"), 3)
    with pytest.raises(LevelError, match="order"):
        StageRequest(labels=("L1", "T9", "T11"))


def test_two_images_differ_in_a_pixel_at_least() -> None:
    pixels = np.zeros((4, 4), np.uint8)
    other = pixels.copy()
    other[1, 2] = 1
    require_two_images(Frame(pixels, "left"), Frame(other, "right"))
    with pytest.raises(SameImageError):
        require_two_images(Frame(pixels, "left"), Frame(pixels.copy(), "right"))


def test_labels_are_decided_again_with_the_poses_of_another_stage() -> None:
    measurer = StageMeasurer(parse_rig((SAMPLES / "D1" / "rig.json").read_bytes()))
    before = measurer.measure(*frames(sample("PRE")), REQUEST)
    open_ = measurer.measure(*frames(without(sample("INTER"), T7_IN_INTER)), REQUEST)
    assert [triad.label for triad in open_.triads] == [None] * 3
    known = {triad.label: triad.triad.pose for triad in before.triads if triad.label and triad.triad.pose}
    decided = relabelled(open_, replace(REQUEST, known=KnownConfiguration(poses=known)))
    assert [triad.label for triad in decided.triads] == ["L1", "T11", "T9"]
    assert poses(decided) == poses(open_)
    assert {flag.code for flag in open_.flags} - {flag.code for flag in decided.flags} == {"labels-uncertain"}
    assert relabelled(open_, REQUEST).flags == open_.flags
