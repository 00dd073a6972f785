from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256

import numpy as np
import pytest
from PIL import Image

from spinewatch.arrays import Pixels
from spinewatch.imaging.comparison import textured_strip
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame, Side
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.tracking.synchronization import SynchronizationParameters
from store.stage_work import EarlierStage, StageWork
from tests.paths import SAMPLES
from tests.store.builders import sample_pair
from workers.record_checks import (
    age_flags,
    burst_repetition_flags,
    change_flags,
    gray_level_digests,
    repetition_flags,
    require_files,
    time_flags,
    view_delay_flags,
)
from workers.registry import FilesWantedError
from workers.strips import packed

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
HOUR = timedelta(hours=1)
TOLERANCE = timedelta(minutes=5)

Files = tuple[bytes, bytes]
LOADED: dict[str, bytes] = {}
"""Files of earlier stages by their SHA-256."""


def by_side(files: Files) -> dict[str, bytes]:
    return {"left": files[0], "right": files[1]}


def hashes(files: Files) -> dict[str, str]:
    return {side: sha256(content).hexdigest() for side, content in by_side(files).items()}


def earlier(
    name: str, files: Files = (b"l", b"r"), captured_at: datetime | None = None, loaded: bool = True
) -> EarlierStage:
    if loaded:
        LOADED.update(zip(hashes(files).values(), files, strict=True))
    return EarlierStage(name, captured_at, hashes(files), is_compared=loaded)


def work(
    files: Files = (b"left", b"right"),
    before: Sequence[EarlierStage] = (),
    captured_at: datetime | None = None,
    calibrated_at: datetime | None = None,
) -> StageWork:
    return StageWork(
        left=files[0],
        right=files[1],
        sha256=hashes(files),
        rig={},
        captured_at=captured_at,
        calibrated_at=calibrated_at,
        calibration_created_at=NOON,
        calibration_age=timedelta(0),
        earlier=tuple(before),
        vertebrae=("L1",),
        extra_levels=(),
        spine_axis="x",
        files=LOADED,
    )


def repeated(files: Files, *before: EarlierStage) -> Mapping[str, str]:
    pixels: dict[Side, Pixels] = {"left": decode_image(files[0]), "right": decode_image(files[1])}
    found = repetition_flags(work(files, before), pixels)
    return {flag.code: flag.detail for flag in found}


def other_files(files: Files, noise: float) -> Files:
    def change(content: bytes) -> bytes:
        gray = decode_image(content).astype(np.float64)
        gray += noise * np.random.default_rng(5).standard_normal(gray.shape)
        buffer = io.BytesIO()
        Image.fromarray(np.clip(np.rint(gray), 0, 255).astype(np.uint8)).save(buffer, "TIFF")
        return buffer.getvalue()

    return change(files[0]), change(files[1])


PRE, INTER = sample_pair("PRE"), sample_pair("INTER")


def test_stages_of_their_own_raise_nothing() -> None:
    assert repeated(INTER, earlier("PRE", PRE), earlier("POST", sample_pair("POST"))) == {}


def test_the_same_files_are_repeated_however_long_ago() -> None:
    flags = repeated(PRE, earlier("PRE", PRE, loaded=False), earlier("INTER", INTER))
    assert list(flags) == ["frame-repeated"]
    assert flags["frame-repeated"].startswith(
        "the left image is that of stage PRE again (all pixels are equal)"
    )
    assert "the right image is that of stage PRE again" in flags["frame-repeated"]


@pytest.mark.parametrize(
    ("noise", "difference"), [(0.0, "all pixels are equal"), (1.0, "gray levels of noise")]
)
def test_the_same_images_in_other_files_are_repeated(noise: float, difference: str) -> None:
    flags = repeated(other_files(PRE, noise), earlier("PRE", PRE))
    assert list(flags) == ["frame-repeated"]
    assert difference in flags["frame-repeated"]


def test_one_repeated_side_is_named_with_the_other() -> None:
    detail = repeated((PRE[0], INTER[1]), earlier("PRE", PRE))["frame-repeated"]
    assert "the left image is that of stage PRE" in detail
    assert "but the right one is not" in detail


@pytest.mark.parametrize("loaded", [True, False])
def test_an_image_sent_as_the_other_side_is_mixed(loaded: bool) -> None:
    flags = repeated((PRE[1], PRE[0]), earlier("PRE", PRE, loaded=loaded))
    assert list(flags) == ["pair-mixed"]
    assert "the right image of stage PRE" in flags["pair-mixed"] or "the left image of" in flags["pair-mixed"]


def test_an_image_of_the_other_side_in_another_file_is_mixed() -> None:
    left, _ = other_files((PRE[1], PRE[0]), 0.0)
    assert "pair-mixed" in repeated((left, INTER[1]), earlier("PRE", PRE))


def test_an_earlier_stage_that_cannot_be_decoded_is_not_compared() -> None:
    assert repeated(PRE, earlier("BROKEN", (b"no", b"image"))) == {}


def with_strips(name: str, files: Files) -> EarlierStage:
    strips = {side: textured_strip(decode_image(content)) for side, content in by_side(files).items()}
    stored = {side: packed(strip) for side, strip in strips.items() if strip is not None}
    return replace(earlier(name, files), strips=stored)


def wanted(files: Files, *before: EarlierStage) -> frozenset[str]:
    pixels: dict[Side, Pixels] = {"left": decode_image(files[0]), "right": decode_image(files[1])}
    asking = replace(work(files, before), files=None)
    require_files(
        replace(asking, files={}), pixels
    )  # a damaged file is not there, however often it is asked for
    try:
        require_files(asking, pixels)
    except FilesWantedError as error:
        return error.sha256
    return frozenset()


def test_images_without_strips_are_asked_for_if_they_are_to_be_compared() -> None:
    broken = replace(
        earlier("BROKEN", INTER), strips={"left": b"no strip", "right": b"no strip of any image"}
    )
    assert wanted(INTER, earlier("PRE", PRE)) == set(hashes(PRE).values())
    assert wanted(PRE, broken) == set(hashes(INTER).values())
    assert wanted(INTER, earlier("OTHER", (b"x", b"y"), loaded=False)) == set()


def test_images_whose_strips_differ_are_not_asked_for() -> None:
    assert wanted(INTER, with_strips("PRE", PRE), with_strips("POST", sample_pair("POST"))) == set()


@pytest.mark.parametrize("noise", [1.0, 6.0, 9.0, 10.4, 14.0])
def test_flags_do_not_depend_on_whether_the_strips_are_stored(noise: float) -> None:
    files = other_files(PRE, noise)
    stored, missing = with_strips("PRE", PRE), earlier("PRE", PRE)
    of_stored = repeated(files, stored) if wanted(files, stored) else {}
    assert of_stored == repeated(files, missing)


def test_images_that_are_repeated_or_mixed_are_asked_for_and_flagged() -> None:
    before = with_strips("PRE", PRE)
    assert wanted(other_files(PRE, 1.0), before) == set(hashes(PRE).values())
    assert wanted((other_files(PRE, 1.0)[0], INTER[1]), before) == {hashes(PRE)["left"]}
    mixed, _ = other_files((PRE[1], PRE[0]), 0.0)
    assert wanted((mixed, INTER[1]), before) == {hashes(PRE)["right"]}


def flagged(given: StageWork) -> list[str]:
    return [flag.detail for flag in time_flags(given, TOLERANCE)]


def test_unknown_and_ordered_times_raise_nothing() -> None:
    assert flagged(work()) == []
    assert flagged(work(before=[earlier("PRE", captured_at=NOON)])) == []
    before = [earlier("PRE", captured_at=NOON), earlier("INTER")]
    assert flagged(work(before=before, captured_at=NOON + HOUR, calibrated_at=NOON - HOUR)) == []


def test_clocks_may_differ_by_the_tolerance() -> None:
    stage = work(before=[earlier("PRE", captured_at=NOON)], captured_at=NOON - TOLERANCE, calibrated_at=NOON)
    assert flagged(stage) == []
    assert len(flagged(replace(stage, captured_at=NOON - TOLERANCE - timedelta(seconds=1)))) == 2


def test_a_stage_before_its_calibration_is_flagged_with_both_times() -> None:
    (detail,) = flagged(work(captured_at=NOON - 24 * HOUR, calibrated_at=NOON))
    assert "24.0 hours before the rig was calibrated" in detail
    assert "2026-11-20T12:00:00+00:00, 2026-11-21T12:00:00+00:00" in detail


def test_without_a_time_of_the_calibration_that_of_its_storage_counts() -> None:
    (detail,) = flagged(work(captured_at=NOON - 72 * HOUR))
    assert "3 days before the rig was stored" in detail
    assert "give calibrated_at" in detail


def test_a_stage_before_one_that_was_sent_earlier_is_flagged() -> None:
    before = [earlier("PRE", captured_at=NOON + 2 * HOUR), earlier("INTER", captured_at=NOON + HOUR)]
    (detail,) = flagged(work(before=before, captured_at=NOON + 1.5 * HOUR))
    assert "30 minutes before stage PRE, which was sent earlier" in detail


def test_a_later_take_is_not_before_the_stages_that_follow_it_but_after_them() -> None:
    follows = replace(earlier("POST", captured_at=NOON + 2 * HOUR), follows=True)
    assert flagged(work(before=[follows], captured_at=NOON)) == []
    (detail,) = flagged(work(before=[follows], captured_at=NOON + 3 * HOUR))
    assert "60 minutes after stage POST, which comes after its first take" in detail


def test_a_frozen_view_within_a_burst_is_flagged_once() -> None:
    pairs: list[dict[Side, str]] = [
        {"left": "a", "right": "b"},
        {"left": "c", "right": "b"},
        {"left": "a", "right": "d"},
    ]
    (flag,) = burst_repetition_flags(pairs)
    assert flag.code == "frame-repeated"
    assert "the right image of pair 2 is that of pair 1 again; the left image of pair 3" in flag.detail
    assert list(burst_repetition_flags([{"left": "a", "right": "b"}, {"left": "b", "right": "a"}])) == []


def test_only_a_calibration_beyond_the_largest_age_is_old() -> None:
    assert list(age_flags(timedelta(days=30), 30.0)) == []
    (flag,) = age_flags(timedelta(days=31), 30.0)
    assert flag.code == "calibration-old"
    assert "31.0 days old" in flag.detail


def test_parameters_that_were_changed_are_named() -> None:
    assert list(change_flags({})) == []
    (flag,) = change_flags({"centres.n_kept": (99, 150)})
    assert flag.code == "parameters-changed"
    assert "centres.n_kept (99 instead of 150)" in flag.detail


def test_views_without_times_of_exposure_have_no_delay() -> None:
    rig = parse_rig((SAMPLES / "D1" / "rig.json").read_bytes())
    assert view_delay_flags(work(), rig, SynchronizationParameters()) == ()


def test_equal_gray_levels_have_equal_digests() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    digests = gray_level_digests((Frame(image, "left"), Frame(image.copy(), "right")))
    assert digests["left"] == digests["right"]
    assert gray_level_digests((Frame(image + 1, "left"), Frame(image, "right")))["left"] != digests["left"]
