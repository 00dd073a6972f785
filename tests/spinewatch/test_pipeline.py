from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace

import cv2
import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.errors import ImageSizeError, ParameterError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.parameters import Parameters
from spinewatch.pipeline import StageMeasurer
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.stage import StageMeasurement, StageRequest
from spinewatch.triads.second_look import SecondLookParameters
from spinewatch.triads.variance_factor import VarianceFactorParameters
from tests.paths import SAMPLES

REQUEST = StageRequest(labels=("L1", "T11", "T9", "T7"), spine_axis="x")


@pytest.fixture(scope="module")
def rig() -> Rig:
    return parse_rig((SAMPLES / "D1" / "rig.json").read_bytes())


def frames(stage: str) -> tuple[Frame, Frame]:
    left, right = (
        Frame(decode_image((SAMPLES / "D1" / stage / f"{side}.png").read_bytes()), side) for side in SIDES
    )
    return left, right


def poses(measured: StageMeasurement) -> list[bytes]:
    found = [triad.triad.pose for triad in measured.triads]
    return [pose.covariance.tobytes() + pose.position_mm.tobytes() for pose in found if pose is not None]


def test_a_prepared_measurer_gives_the_same_bits_as_a_new_one_with_or_without_a_pool(rig: Rig) -> None:
    first, second = frames("PRE"), frames("POST")
    with ThreadPoolExecutor(max_workers=1) as pool:
        prepared = StageMeasurer(rig, pool=pool)
        both = [poses(prepared.measure(*pair, REQUEST)) for pair in (first, second, first)]
    assert both[0] == both[2]
    assert both[1] == poses(StageMeasurer(rig).measure(*second, REQUEST))
    assert len(both[0]) == len(both[1]) == 4


def test_a_blurred_pair_has_most_of_its_triads(rig: Rig) -> None:
    left, right = (
        Frame(cv2.GaussianBlur(frame.pixels, (0, 0), 1.5).astype(np.uint8), frame.side)
        for frame in frames("PRE")
    )
    assert len(poses(StageMeasurer(rig).measure(left, right, REQUEST))) >= 3


def test_a_second_look_at_a_blurred_pair_loses_no_triad(rig: Rig) -> None:
    left, right = (
        Frame(cv2.GaussianBlur(frame.pixels, (0, 0), 1.8).astype(np.uint8), frame.side)
        for frame in frames("PRE")
    )
    search = Parameters().search
    # at this blur most of the triads are doubtful, however often they are sought
    twice = replace(Parameters(), search=replace(search, doubt=replace(search.doubt, max_chance=1.0)))
    once = replace(twice, second_look=SecondLookParameters(rounds=0))
    before, after = (len(poses(StageMeasurer(rig, p).measure(left, right, REQUEST))) for p in (once, twice))
    assert after >= before >= 3


def test_the_measurement_holds_what_it_was_made_with(rig: Rig) -> None:
    parameters = replace(Parameters(), labels=replace(Parameters().labels, spacing_sd=0.2))
    measurer = StageMeasurer(rig, parameters)
    steps: list[tuple[str, float]] = []
    measured = measurer.measure(
        *frames("PRE"), REQUEST, lambda step, fraction: steps.append((step, fraction))
    )
    assert asdict(measured.parameters)["labels"]["spacing_sd"] == 0.2
    assert measured.templates_version
    assert [step for step, _ in steps] == ["detect", "match", "label"]
    assert [fraction for _, fraction in steps] == sorted(fraction for _, fraction in steps)


def test_flags_about_an_image_name_its_side(rig: Rig) -> None:
    left, right = frames("PRE")
    blank = replace(right, pixels=np.full_like(right.pixels, 7))
    measured = StageMeasurer(rig).measure(left, blank, REQUEST)
    (flag,) = [flag for flag in measured.flags if flag.code == "blank-image"]
    assert flag.detail.startswith("right: ")


def test_deviations_follow_the_residuals_of_the_triads(rig: Rig) -> None:
    usual, unusual, trusting = (
        StageMeasurer(
            rig,
            replace(
                Parameters(), variance_factor=VarianceFactorParameters(enabled=enabled, expected=expected)
            ),
        ).measure(*frames("PRE"), REQUEST)
        for enabled, expected in ((True, 5.0), (True, 0.1), (False, 0.1))
    )
    assert [flag.code for flag in unusual.flags] == ["appearance-unusual"]
    assert not usual.flags
    assert poses(trusting) == poses(usual)
    factor = unusual.left.features.covariance_px2 / usual.left.features.covariance_px2
    assert factor == pytest.approx(factor[0, 0, 0])
    assert factor[0, 0, 0] > VarianceFactorParameters().max_usual
    for before, after in zip(usual.triads, unusual.triads, strict=True):
        assert before.label == after.label
        assert before.triad.pose is not None
        assert after.triad.pose is not None
        assert np.all(after.triad.pose.position_sd_mm > before.triad.pose.position_sd_mm)
        assert after.triad.pose.position_mm == pytest.approx(before.triad.pose.position_mm, abs=0.05)


def test_impossible_pairs_are_refused(rig: Rig) -> None:
    left, right = frames("PRE")
    measurer = StageMeasurer(rig)
    with pytest.raises(SameImageError):
        measurer.measure(left, replace(left, side="right"), REQUEST)
    with pytest.raises(ImageSizeError):
        measurer.measure(left, replace(right, pixels=right.pixels[:-1]), REQUEST)
    with pytest.raises(ParameterError):
        measurer.measure(right, left, REQUEST)


def test_a_spine_along_the_other_axis_is_named(rig: Rig) -> None:
    left, right = (
        Frame(decode_image((SAMPLES / "D1" / "PRE" / f"{side}.png").read_bytes()), side) for side in SIDES
    )
    measured = StageMeasurer(rig).measure(left, right, replace(REQUEST, spine_axis="y"))
    flags = {flag.code: flag.detail for flag in measured.flags}
    assert "along x: 4" in flags["spine-axis-implausible"]
    assert "no-triads" not in flags
    assert {triad.label for triad in measured.triads} == {None}


def test_a_rig_with_parallel_axes_needs_a_range(rig: Rig) -> None:
    parallel = Rig("parallel", rig.left, replace(rig.right, rotation_deg=rig.left.rotation_deg))
    with pytest.raises(ParameterError, match="range"):
        StageMeasurer(parallel)


def test_exchanged_images_are_named_as_the_cause(rig: Rig) -> None:
    left, right = frames("PRE")
    measured = StageMeasurer(rig).measure(replace(right, side="left"), replace(left, side="right"), REQUEST)
    (flag,) = [flag for flag in measured.flags if flag.code == "no-triads"]
    assert "exchanged" in flag.detail


def test_a_camera_that_moved_is_flagged_with_and_without_triads(rig: Rig) -> None:
    for rotation_deg, codes in (
        ((0.0, 0.5, 0.0), {"calibration-drift"}),
        ((0.3, 0.0, 0.0), {"calibration-drift", "no-triads", "triad-count-low"}),
    ):
        moved = Rig("moved", rig.left, rig.right.moved(np.radians(rotation_deg), np.zeros(3)))
        measured = StageMeasurer(moved).measure(*frames("PRE"), REQUEST)
        assert codes <= {flag.code for flag in measured.flags}


def test_more_triads_than_labels_have_no_label(rig: Rig) -> None:
    measured = StageMeasurer(rig).measure(*frames("PRE"), StageRequest(labels=("L1", "T9"), spine_axis="x"))
    assert "triad-count-high" in {flag.code for flag in measured.flags}
    assert [triad.label for triad in measured.triads] == [None] * 4


def test_one_exposure_with_other_noise_is_no_pair(rig: Rig) -> None:
    left, _ = frames("PRE")
    noise = np.random.default_rng(1).normal(0, 2, left.pixels.shape)
    again = np.clip(left.pixels + noise, 0, 255).astype(np.uint8)
    with pytest.raises(SameImageError, match="same image"):
        StageMeasurer(rig).measure(left, Frame(again, "right"), REQUEST)
