"""Transforms: points move as they should, by our matrices, by the file's own convention, and in Slicer."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contract.summary import SurgerySummary
from exports import slicer_transforms
from exports.coordinates import LPS_FROM_PATIENT, RAS_FROM_PATIENT
from spinewatch.arrays import Float
from tests.contract.spine_results import pose
from tests.exports.hostile import TEXTS, many_stages, stage_without_spine, with_text, without_spines

POINT = np.array([10.0, -4.0, 7.0])
"""A point of a vertebra, in its own axes: anterior, left, cephalad, mm."""


def opened(summary: SurgerySummary, stage: str | None = None) -> tuple[dict[str, Any], dict[str, bytes]]:
    with zipfile.ZipFile(io.BytesIO(slicer_transforms.export(summary, stage))) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    index: dict[str, Any] = json.loads(files.pop("transforms.json"))
    return index, files


def entry(index: dict[str, Any], stage: str, vertebra: str, kind: str) -> dict[str, Any]:
    (found,) = (
        item
        for item in index["transforms"]
        if (item["stage"], item["vertebra"]) == (stage, vertebra) and item["kind"].startswith(kind)
    )
    return dict(found)


def from_parent(content: bytes) -> Float:
    """Return the matrix of an ITK file, as ITK documents it: y = A (x - c) + t + c, from the parent."""
    lines = dict(line.split(": ") for line in content.decode().splitlines() if ": " in line)
    numbers = np.array(lines["Parameters"].split(), dtype=float)
    assert lines["FixedParameters"].split() == ["0.0"] * 3
    assert lines["Transform"] == "AffineTransform_double_3_3"
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = numbers[:9].reshape(3, 3), numbers[9:]
    return matrix


def place(stage: int) -> Float:
    """Return where the point of T9 is at a stage, in patient axes."""
    body = pose("T9", stage)
    return np.asarray(body.position_mm + body.rotation @ POINT)


def test_a_stage_without_a_spine_is_listed_with_its_reason(summary: SurgerySummary) -> None:
    whole = summary.model_copy(update={"stages": [summary.stages[0], stage_without_spine(summary)]})
    index, _ = opened(whole)
    reason = "the reference triad L1 has no pose in stage POST"
    assert index["stages_without_spine"] == [{"stage": "POST", "take": 1, "reason": reason}]


def test_a_pose_puts_a_point_of_the_vertebra_in_its_place(summary: SurgerySummary) -> None:
    index, files = opened(summary)
    found = entry(index, "POST", "T9", "pose")
    matrix = np.array(found["matrix_to_parent"])
    moved = matrix @ np.append(LPS_FROM_PATIENT @ POINT, 1.0)
    np.testing.assert_allclose(moved[:3], LPS_FROM_PATIENT @ place(2), atol=1e-9)
    back = from_parent(files[found["file"]]) @ moved
    np.testing.assert_allclose(back[:3], LPS_FROM_PATIENT @ POINT, atol=1e-9)


def test_a_motion_takes_a_point_from_the_baseline_to_the_stage(summary: SurgerySummary) -> None:
    index, files = opened(summary)
    found = entry(index, "POST", "T9", "motion")
    assert found["kind"] == "motion since PRE"
    start = np.append(LPS_FROM_PATIENT @ place(0), 1.0)
    end = np.append(LPS_FROM_PATIENT @ place(2), 1.0)
    np.testing.assert_allclose(np.array(found["matrix_to_parent"]) @ start, end, atol=1e-9)
    np.testing.assert_allclose(from_parent(files[found["file"]]) @ end, start, atol=1e-9)


def test_what_has_no_pose_has_no_file_and_a_reason(summary: SurgerySummary) -> None:
    index, files = opened(summary)
    lost = entry(index, "PRE", "T5", "pose")
    assert (lost["file"], lost["matrix_to_parent"]) == (None, None)
    assert lost["reason"] == "it lies outside the marked vertebrae T7 to L1"
    assert lost["origin"] == "not_measured"
    listed = [item["file"] for item in index["transforms"] if item["file"]]
    assert listed == list(files)
    assert len(listed) == 7 * 5


def test_a_stage_alone(summary: SurgerySummary) -> None:
    _, files = opened(summary, "INTER")
    assert {name.split("/")[0] for name in files} == {"INTER"}
    assert opened(without_spines())[1] == {}


@pytest.mark.parametrize("text", TEXTS)
def test_hostile_text_makes_no_other_path(text: str, summary: SurgerySummary) -> None:
    assert list(opened(with_text(text))[1]) == list(opened(summary)[1])


def test_sixty_stages() -> None:
    assert len(opened(many_stages())[1]) == 60 * (17 + 7)


@pytest.mark.timeout(900)  # the first run installs Slicer's libraries
@pytest.mark.parametrize("kind", ["pose", "motion"])
def test_slicer_moves_the_point_so(
    summary: SurgerySummary, tmp_path: Path, read_by_slicer: Callable[[Path], Any], kind: str
) -> None:
    index, files = opened(summary)
    path = tmp_path / "T9.tfm"
    path.write_bytes(files[entry(index, "POST", "T9", kind)["file"]])
    to_parent = np.array(read_by_slicer(path))
    start = POINT if kind == "pose" else place(0)
    moved = to_parent @ np.append(RAS_FROM_PATIENT @ start, 1.0)
    np.testing.assert_allclose(moved[:3], RAS_FROM_PATIENT @ place(2), atol=1e-6)
