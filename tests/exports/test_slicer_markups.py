"""Markups: valid, where Slicer should see them, and with the angle that Slicer measures itself."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from contract.summary import SurgerySummary
from exports import slicer_markups
from exports.selection import UnknownStageError
from exports.vertebra_size import body_size_mm
from tests.contract.spine_results import pose
from tests.exports.hostile import TEXTS, many_stages, stage_without_spine, with_text, without_spines
from tests.paths import DATA

SCHEMA = json.loads((DATA / "slicer_markups.schema.json").read_text())
COBB = ["285285000", "SCT", "Cobb angle"]


def markups(summary: SurgerySummary, stage: str | None = None) -> list[dict[str, Any]]:
    document = json.loads(slicer_markups.export(summary, stage))
    jsonschema.validate(document, SCHEMA)
    found: list[dict[str, Any]] = document["markups"]
    return found


def named(found: list[dict[str, Any]], name: str) -> dict[str, Any]:
    (match,) = (markup for markup in found if markup["name"] == name)
    return match


def test_each_stage_has_its_centroids_end_plates_and_angle(summary: SurgerySummary) -> None:
    assert [markup["name"] for markup in markups(summary, "INTER")] == [
        "INTER vertebrae", "INTER curve 1 superior end plate T7", "INTER curve 1 inferior end plate L1",
        "INTER curve 1 Cobb",
    ]  # fmt: skip
    assert len(markups(summary)) == 13


def test_a_stage_without_a_spine_is_named_with_its_reason(
    summary: SurgerySummary, tmp_path: Path, read_by_slicer: Callable[[Path], Any]
) -> None:
    whole = summary.model_copy(update={"stages": [summary.stages[0], stage_without_spine(summary)]})
    (point,) = named(markups(whole), "POST has no spine")["controlPoints"]
    assert point["description"] == "the reference triad L1 has no pose in stage POST"
    assert point["positionStatus"] == "undefined"


def test_measures_of_a_curve_name_its_open_ends(summary: SurgerySummary) -> None:
    measured = named(markups(summary), "PRE vertebrae")["measurements"]
    beyond = "the curve may go on beyond L1, which is the end of the measured span"
    assert {value["name"] for value in measured if beyond in value["description"]} == {
        value["name"] for value in measured if "curve 1" in value["name"]
    }
    (angle,) = named(markups(summary), "PRE curve 1 Cobb")["measurements"][:1]
    assert angle["description"].endswith(beyond)


def test_centroids_are_left_posterior_superior(summary: SurgerySummary) -> None:
    points = named(markups(summary), "POST vertebrae")["controlPoints"]
    assert [point["label"] for point in points][:3] == ["T5", "T6", "T7"]
    x, y, z = pose("T8", 2).position_mm
    (point,) = (point for point in points if point["label"] == "T8")
    assert point["position"] == pytest.approx([y, -x, z])
    assert point["description"].startswith("interpolated; sd anterior 0.60, left 0.60, cephalad 1.00 mm")
    assert points[0]["positionStatus"] == "undefined"
    assert points[0]["description"] == "not measured: it lies outside the marked vertebrae T7 to L1"


def test_an_end_plate_is_where_the_body_ends(summary: SurgerySummary) -> None:
    right, left = (
        np.array(point["position"])
        for point in named(markups(summary), "PRE curve 1 superior end plate T7")["controlPoints"]
    )
    _, width, height = body_size_mm("T7")
    body = pose("T7", 0)
    x, y, z = body.position_mm + height / 2 * body.rotation[:, 2]
    np.testing.assert_allclose((left + right) / 2, [y, -x, z])
    x, y, z = body.rotation[:, 1]
    np.testing.assert_allclose((left - right) / width, [y, -x, z], atol=1e-12)


def test_measures_carry_codes_definitions_and_intervals(summary: SurgerySummary) -> None:
    values = named(markups(summary), "PRE vertebrae")["measurements"]
    cobb, reselected, rotation, translation, kyphosis, _, measured, bracketed = values
    assert cobb["quantityCode"] == reselected["quantityCode"] == COBB
    assert cobb["methodCode"][:2] == ["cobb-fixed", "99SPINEWATCH"]
    assert reselected["methodCode"][:2] == ["cobb-reselected", "99SPINEWATCH"]
    assert cobb["value"] == 58.3
    assert "sd 1.10 deg; 95% interval 56.14 to 60.46" in cobb["description"]
    assert "status bracketed" in reselected["description"]
    assert rotation["quantityCode"][:2] == ["apical-rotation", "99SPINEWATCH"]
    assert (rotation["units"][0], translation["units"][0]) == ("deg", "mm")
    assert kyphosis["enabled"] is False
    assert "value" not in kyphosis
    assert (measured["value"], bracketed["value"]) == (31.5, 4.5)
    assert measured["methodCode"] == bracketed["methodCode"] == kyphosis["methodCode"]


def test_a_curve_without_one_of_its_ends_has_no_angle(summary: SurgerySummary) -> None:
    spine = summary.stages[0].spine
    assert spine is not None
    curve = spine.curves[0].model_copy(update={"upper": "T6"})
    other = spine.model_copy(update={"curves": [curve]})
    stage = summary.stages[0].model_copy(update={"spine": other})
    found = markups(summary.model_copy(update={"stages": [stage]}))
    assert [markup["name"] for markup in found] == ["PRE vertebrae", "PRE curve 1 inferior end plate L1"]


@pytest.mark.parametrize("text", TEXTS)
def test_hostile_text_stays_on_its_line(text: str) -> None:
    markups(with_text(text))


def test_without_any_spine_every_stage_has_its_reason() -> None:
    found = markups(without_spines())
    assert [markup["name"] for markup in found] == [
        f"{name} has no spine" for name in ("PRE", "INTER", "POST", "EXTRA")
    ]
    assert {point["description"] for markup in found for point in markup["controlPoints"]} == {"no setup"}


def test_an_unknown_stage_is_refused(summary: SurgerySummary) -> None:
    with pytest.raises(UnknownStageError):
        slicer_markups.export(summary, "LATER")


def test_sixty_stages() -> None:
    assert len(markups(many_stages())) == 60 * 4


@pytest.mark.timeout(900)  # the first run installs Slicer's libraries
def test_slicer_reads_the_same(
    summary: SurgerySummary, tmp_path: Path, read_by_slicer: Callable[[Path], Any]
) -> None:
    path = tmp_path / "spine.mrk.json"
    path.write_bytes(slicer_markups.export(summary))
    nodes = {node["name"]: node for node in read_by_slicer(path)}
    assert len(nodes) == 13
    assert nodes["EXTRA has no spine"]["points"][0]["ras"] is None
    points = {point["label"]: point["ras"] for point in nodes["POST vertebrae"]["points"]}
    x, y, z = pose("T9", 2).position_mm
    assert points["T9"] == pytest.approx([-y, x, z])
    assert points["T5"] is None
    cobb, *_, lordosis, kyphosis, _ = nodes["PRE vertebrae"]["measurements"]
    assert (cobb["value"], cobb["quantity"], cobb["units"][:2]) == (58.3, COBB, ["deg", "UCUM"])
    assert cobb["method"][0] == "cobb-fixed"
    assert not lordosis["defined"]
    assert kyphosis["value"] == 31.5


@pytest.mark.timeout(900)
def test_slicer_measures_the_cobb_angle_itself(
    summary: SurgerySummary, tmp_path: Path, read_by_slicer: Callable[[Path], Any]
) -> None:
    path = tmp_path / "spine.mrk.json"
    path.write_bytes(slicer_markups.export(summary))
    nodes = {node["name"]: node for node in read_by_slicer(path)}
    for stage, name in enumerate(("PRE", "INTER", "POST")):
        measured = {item["name"]: item["value"] for item in nodes[f"{name} curve 1 Cobb"]["measurements"]}
        upper, lower = (pose(level, stage).rotation[:, 2] for level in ("T7", "L1"))
        tilts = [np.degrees(np.arctan2(-z[1], z[2])) for z in (upper, lower)]
        assert measured["angle"] == pytest.approx(abs(tilts[1] - tilts[0]), abs=1e-6)
