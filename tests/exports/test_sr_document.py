import io
from collections.abc import Iterator
from typing import Any

import pytest
from highdicom import sr
from pydicom.sr.codedict import codes

from contract.summary import SurgerySummary
from exports.codes import site
from exports.entries import Entry, entries
from exports.sr_document import write
from tests.contract.spine_results import stage_spine
from tests.exports.hostile import stage_without_spine

Group = sr.MeasurementsAndQualitativeEvaluations


@pytest.fixture(scope="module")
def groups(summary: SurgerySummary) -> list[Any]:
    """Measurement groups as highdicom reads them from the file."""
    return groups_of(summary)


def groups_of(summary: SurgerySummary) -> list[Any]:
    report = sr.srread(io.BytesIO(write(summary))).content
    assert isinstance(report, sr.MeasurementReport)
    return list(report.get_image_measurement_groups())


def properties(item: Any) -> dict[str, Any]:
    """What is below a content item, by the code of its name."""
    content = getattr(item, "ContentSequence", ())
    return {child.name.value: child.value for child in content}


def stage_of(group: Any) -> str:
    return str(properties(group[0])["C2348792"])


def children(group: Any, value_type: str) -> Iterator[Any]:
    """Results of a group, without what describes the group itself."""
    found = (item for item in group[0].ContentSequence if item.ValueType == value_type)
    return (item for item in found if item.RelationshipType == "CONTAINS")


def key(item: Any) -> tuple[object, ...]:
    """Name, definition, derivation, stage of comparison and vertebrae of a result."""
    below = properties(item)
    method = below["370129005"].value if "370129005" in below else item.name.value
    derivation = below["121401"].value if "121401" in below else None
    return item.name.value, method, derivation, below.get("since"), *vertebrae(item)


def vertebrae(item: Any) -> list[str]:
    """Codes of the finding sites of a result."""
    content = getattr(item, "ContentSequence", ())
    return [child.value.value for child in content if child.name == codes.SCT.FindingSite]


def key_of(entry: Entry) -> tuple[object, ...]:
    name = "285285000" if entry.code in {"cobb-fixed", "cobb-reselected"} else entry.code
    levels = () if entry.kind == "vertebra" else entry.levels
    return name, entry.code, entry.derivation, entry.since, *(site(level).code.value for level in levels)


def test_every_number_is_read_back_with_its_interval(groups: list[Any]) -> None:
    found = {
        (stage_of(group), group.tracking_identifier, *key(item)): item
        for group in groups
        for item in children(group, "NUM")
    }
    for number, stage in enumerate(("PRE", "INTER", "POST")):
        for entry in entries(stage_spine(number)):
            if entry.value is None:
                continue
            item = found.pop((stage, entry.subject, *key_of(entry)))
            below = properties(item)
            assert item.value == entry.value
            assert (item.unit.value, item.unit.scheme_designator) == (entry.unit, "UCUM")
            assert entry.interval is not None
            assert below["371886008"] == pytest.approx(entry.interval[1] - entry.value)
            assert below["371885007"] == pytest.approx(entry.value - entry.interval[0])
            assert below["386136009"] == entry.sd
            assert (below["status"].value if "status" in below else "measured") == entry.status
    assert not found


def test_uncertainty_has_the_unit_of_its_value(groups: list[Any]) -> None:
    group = next(g for g in groups if stage_of(g) == "PRE" and g.tracking_identifier == "curve 1")
    numbers = list(children(group, "NUM"))
    assert len(numbers) > 1
    for item in numbers:
        widths = [child for child in item.ContentSequence if child.ValueType == "NUM"]
        assert len(widths) == 3
        assert {width.unit.value for width in widths} == {item.unit.value}


def test_what_was_not_measured_is_an_evaluation_with_a_reason_and_no_number(groups: list[Any]) -> None:
    group = next(g for g in groups if stage_of(g) == "PRE" and g.tracking_identifier == "spine")
    assert [item.value for item in children(group, "NUM")] == [31.5, 4.5]
    (kyphosis,) = (item for item in children(group, "CODE") if item.name.value == "kyphosis")
    assert kyphosis.value.value == "not_measured"
    assert vertebrae(kyphosis) == [site(level).code.value for level in ("T5", "T12")]
    assert properties(kyphosis)["reason"] == "L5 was not measured"


def test_the_cobb_angle_is_coded_by_snomed_with_its_end_vertebrae(groups: list[Any]) -> None:
    group = next(g for g in groups if stage_of(g) == "PRE" and g.tracking_identifier == "curve 1")
    first = next(children(group, "NUM"))
    assert first.name == codes.SCT.CobbAngle
    sites = [child.value for child in first.ContentSequence if child.name == codes.SCT.FindingSite]
    assert sites == [codes.SCT.T7Vertebra, codes.SCT.L1Vertebra]
    assert [site.value for site in group.finding_sites] == [
        codes.SCT.T7Vertebra,
        codes.SCT.T9Vertebra,
        codes.SCT.L1Vertebra,
    ]


def test_a_curve_has_the_same_tracking_uid_at_every_stage(groups: list[Any]) -> None:
    uids: dict[str, set[str]] = {name: set() for name in ("curve 1", "T9", "spine")}
    for group in groups:
        if group.tracking_identifier in uids:
            uids[group.tracking_identifier].add(str(group.tracking_uid))
    assert all(len(found) == 1 for found in uids.values())
    assert len(set.union(*uids.values())) == 3


def test_flags_frame_and_the_reason_of_a_missing_spine_are_texts_of_the_spine(groups: list[Any]) -> None:
    texts = {stage_of(g): properties(g[0]) for g in groups if g.tracking_identifier == "spine"}
    assert texts["POST"]["flag"] == "rig-refined: an example of a flag"
    assert texts["PRE"]["frame"] == stage_spine(0).frame
    assert texts["EXTRA"]["reason"] == "the stage was not measured"


def test_a_stage_without_a_spine_keeps_its_flags(summary: SurgerySummary) -> None:
    whole = summary.model_copy(update={"stages": [*summary.stages[:2], stage_without_spine(summary)]})
    (group,) = (g for g in groups_of(whole) if stage_of(g) == "POST")
    assert properties(group[0])["reason"] == "the reference triad L1 has no pose in stage POST"
    assert properties(group[0])["flag"] == "triad-count-low: 3 of 4 triads"


def test_a_measure_of_a_curve_names_its_open_end(groups: list[Any]) -> None:
    (curve,) = (g for g in groups if (stage_of(g), g.tracking_identifier) == ("PRE", "curve 1"))
    measurements = list(children(curve, "NUM"))
    assert measurements
    for measurement in measurements:
        assert properties(measurement)["open-end"].meaning == "L1 vertebra"
