"""A worker prepares one measurer per rig, parameters and templates."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from spinewatch.detection.candidates.templates import (
    TemplateError,
    default_template_set,
    write_template_set,
)
from spinewatch.parameters import Parameters
from store.stage_work import StageWork
from tests.paths import SAMPLES
from workers.stage_measurers import StageMeasurers, template_set


def work() -> StageWork:
    return StageWork(
        left=b"",
        right=b"",
        sha256={},
        rig=json.loads((SAMPLES / "D1" / "rig.json").read_text()),
        captured_at=None,
        calibrated_at=None,
        calibration_created_at=datetime(2026, 11, 21, tzinfo=UTC),
        calibration_age=timedelta(0),
        earlier=(),
        vertebrae=("L1",),
        extra_levels=(),
        spine_axis="x",
    )


def test_measurers_are_kept_by_rig_and_parameters() -> None:
    measurers = StageMeasurers(default_template_set(), Parameters(), ThreadPoolExecutor(1))
    usual = work()
    refined = replace(usual, measuring=usual.measuring.model_copy(update={"refine": True}))
    first = measurers.of(usual)
    assert measurers.of(work()) is first
    assert measurers.of(refined) is not first
    assert measurers.of(refined).parameters.search.matching.refinement.enabled


def test_what_is_sent_with_the_images_is_no_change() -> None:
    measurers = StageMeasurers(default_template_set(), Parameters(), ThreadPoolExecutor(1))
    assert measurers.changed(work()) == {}


def test_the_template_set_is_read_from_a_file_or_ships(tmp_path: Path) -> None:
    ships = default_template_set()
    assert template_set(None) is ships
    file = tmp_path / "templates.npz"
    file.write_bytes(write_template_set(ships))
    assert template_set(file).version == ships.version
    with pytest.raises(TemplateError, match="SPINEWATCH_TEMPLATES"):
        template_set(tmp_path / "none.npz")
