import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from contract.spine import StageSpine
from contract.summary import SurgerySummary
from exports.codes import SCHEME_URI
from exports.entries import entries
from exports.fhir import export
from tests.contract.spine_results import stage_spine
from tests.exports.hostile import stage_without_spine

Validate = Callable[..., Any]


@pytest.fixture(scope="module")
def bundle(summary: SurgerySummary) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(export(summary))
    return loaded


def resources(bundle: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [entry["resource"] for entry in bundle["entry"] if entry["resource"]["resourceType"] == kind]


def component(observation: dict[str, Any], code: str) -> Any:
    """The value of a component by its code; None if there is none."""
    for item in observation["component"]:
        if item["code"]["coding"][0]["code"] == code:
            return next(value for name, value in item.items() if name.startswith("value"))
    return None


def of_stage(bundle: dict[str, Any], stage: str) -> list[dict[str, Any]]:
    return [found for found in resources(bundle, "Observation") if component(found, "stage") == stage]


def errors(validate: Validate, bundle: dict[str, Any], folder: Path) -> list[Any]:
    path = folder / "bundle.json"
    path.write_text(json.dumps(bundle))
    found = validate("fhir.mjs", path)
    listed = [message for message in found["messages"] if message["severity"] in {"error", "fatal"}]
    assert found["valid"] == (not listed)
    return listed


def test_the_npm_package_fhir_finds_no_error(
    validate: Validate, bundle: dict[str, Any], tmp_path: Path
) -> None:
    assert errors(validate, bundle, tmp_path) == []


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("Observation", {"status": "fnal"}),
        ("Observation", {"code": None}),
        ("Observation", {"valueQuantty": {"value": 1}}),
        ("DetectedIssue", {"status": "prelim"}),
        ("Device", {"deviceName": [{"name": "x", "type": "nickname"}]}),
    ],
)
def test_the_npm_package_fhir_refuses_what_is_wrong(
    kind: str, change: dict[str, Any], validate: Validate, bundle: dict[str, Any], tmp_path: Path
) -> None:
    broken = json.loads(json.dumps(bundle))
    resource = resources(broken, kind)[0]
    resource.update(change)
    for name in [name for name, value in change.items() if value is None]:
        del resource[name]
    assert len(errors(validate, broken, tmp_path)) == 1


def test_every_number_is_an_observation_with_its_interval(bundle: dict[str, Any]) -> None:
    for number, stage in enumerate(("PRE", "INTER", "POST")):
        given = list(entries(stage_spine(number)))
        observations = of_stage(bundle, stage)
        assert len(observations) == len(given)
        for entry, observation in zip(given, observations, strict=True):
            assert observation["method"]["coding"][0] == {
                "system": SCHEME_URI,
                "code": entry.code,
                "display": observation["method"]["coding"][0]["display"],
            }
            assert component(observation, "status")["coding"][0]["code"] == entry.status
            assert component(observation, "since") == entry.since
            if entry.value is None:
                assert "valueQuantity" not in observation
                assert observation["dataAbsentReason"]["text"] == entry.reason
                continue
            assert observation["valueQuantity"] == {
                "value": entry.value,
                "unit": entry.unit,
                "system": "http://unitsofmeasure.org",
                "code": entry.unit,
            }
            assert entry.interval is not None
            assert component(observation, "interval-low")["value"] == entry.interval[0]
            assert component(observation, "interval-high")["value"] == entry.interval[1]
            assert component(observation, "386136009")["value"] == entry.sd


def test_the_cobb_angle_is_coded_by_snomed_with_its_vertebrae(bundle: dict[str, Any]) -> None:
    cobb = of_stage(bundle, "PRE")[0]
    assert cobb["code"]["coding"][0] == {
        "system": "http://snomed.info/sct",
        "code": "285285000",
        "display": "Cobb angle",
    }
    assert cobb["bodySite"]["coding"][0]["code"] == "421060004"
    assert cobb["bodySite"]["text"] == "T7 to L1"
    vertebrae = [
        item["valueCodeableConcept"]["coding"][0]["code"]
        for item in cobb["component"]
        if item["code"]["coding"][0]["code"] == "vertebra"
    ]
    assert vertebrae == ["62487009", "66794005"]
    rotation = next(
        o for o in of_stage(bundle, "PRE") if o["method"]["coding"][0]["code"] == "apical-rotation"
    )
    assert rotation["bodySite"]["coding"][0]["code"] == "82687006"


def test_only_an_angle_is_coded_as_an_angle_and_what_is_derived_has_a_code_of_its_own(
    bundle: dict[str, Any],
) -> None:
    observations = [
        o for o in of_stage(bundle, "POST") if o["method"]["coding"][0]["code"].startswith("cobb")
    ]
    coded = {(o["code"]["coding"][0]["code"], derivation_of(o)) for o in observations}
    assert coded == {
        ("285285000", None),
        ("cobb-fixed.change", "change"),
        ("cobb-fixed.by-rotation", "by-rotation"),
        ("cobb-fixed.by-distraction", "by-distraction"),
        ("cobb-fixed.remainder", "remainder"),
        ("cobb-fixed.remaining", "remaining"),
    }
    for observation in of_stage(bundle, "POST"):
        code, derivation = observation["code"]["coding"][0]["code"], derivation_of(observation)
        assert ("." in code) == (derivation is not None)


def derivation_of(observation: dict[str, Any]) -> str | None:
    found = component(observation, "derivation")
    return None if found is None else str(found["coding"][0]["code"])


def test_every_pair_of_vertebrae_has_its_observation(bundle: dict[str, Any]) -> None:
    kyphosis = [
        (o["code"]["coding"][0]["code"], o["bodySite"]["text"], o.get("valueQuantity", {}).get("value"))
        for o in of_stage(bundle, "INTER")
        if o["method"]["coding"][0]["code"] == "kyphosis"
    ]
    assert kyphosis == [
        ("kyphosis", "T5 to T12", None),
        ("kyphosis", "T7 to T12", 32.5),
        ("kyphosis", "T10 to L1", 5.5),
        ("kyphosis.change", "T7 to T12", 1.25),
        ("kyphosis.change", "T10 to L1", -0.75),
    ]


def test_only_what_is_measured_is_final(bundle: dict[str, Any]) -> None:
    status = {
        "measured": "final",
        "not_measured": "final",
        "bracketed": "preliminary",
        "interpolated": "preliminary",
    }
    found = set()
    for observation in resources(bundle, "Observation"):
        code = component(observation, "status")["coding"][0]["code"]
        open_ended = component(observation, "open-end") is not None and "valueQuantity" in observation
        assert observation["status"] == ("preliminary" if open_ended else status[code])
        found.add(code)
    assert found == set(status)


def test_what_is_assumed_is_preliminary(summary: SurgerySummary) -> None:
    spine = stage_spine(0)
    measures = [measure.model_copy(update={"assumed": True}) for measure in spine.measures]
    bundle = json.loads(export(with_spine(summary, spine.model_copy(update={"measures": measures}))))
    cobb = of_stage(bundle, "PRE")[0]
    assert cobb["status"] == "preliminary"
    assert "assumed" in cobb["note"][0]["text"]


def with_spine(summary: SurgerySummary, spine: StageSpine) -> SurgerySummary:
    stage = summary.stages[0].model_copy(update={"spine": spine})
    return summary.model_copy(update={"stages": [stage]})


def test_there_is_no_patient_and_every_subject_is_the_case_number(bundle: dict[str, Any]) -> None:
    assert {entry["resource"]["resourceType"] for entry in bundle["entry"]} == {
        "Device",
        "Observation",
        "DetectedIssue",
    }
    for resource in (*resources(bundle, "Observation"), *resources(bundle, "DetectedIssue")):
        subject = resource.get("subject") or resource["patient"]
        assert subject == {"identifier": {"type": {"text": "case number"}, "value": "2026-0417"}}


def test_a_stage_without_a_spine_says_why(bundle: dict[str, Any]) -> None:
    (observation,) = of_stage(bundle, "EXTRA")
    assert observation["dataAbsentReason"]["text"] == "the stage was not measured"


def test_a_stage_without_a_spine_keeps_its_flags(summary: SurgerySummary) -> None:
    stages = [*summary.stages[:2], stage_without_spine(summary)]
    bundle = json.loads(export(summary.model_copy(update={"stages": stages})))
    (observation,) = of_stage(bundle, "POST")
    assert observation["dataAbsentReason"]["text"] == "the reference triad L1 has no pose in stage POST"
    (issue,) = resources(bundle, "DetectedIssue")
    assert issue["detail"] == "POST: 3 of 4 triads"


def test_a_measure_of_a_curve_with_an_open_end_is_preliminary_and_names_the_end(
    bundle: dict[str, Any],
) -> None:
    of_curve = [found for found in of_stage(bundle, "PRE") if component(found, "curve") is not None]
    assert {found["status"] for found in of_curve} == {"preliminary"}
    for found in of_curve:
        assert component(found, "open-end")["coding"][0]["display"] == "L1 vertebra"
        assert "The curve may go on beyond L1, which is the end of the measured span." in [
            note["text"] for note in found["note"]
        ]


def test_flags_are_detected_issues(bundle: dict[str, Any]) -> None:
    (issue,) = resources(bundle, "DetectedIssue")
    assert issue["code"]["coding"][0]["code"] == "rig-refined"
    assert issue["detail"] == "POST: an example of a flag"


def test_identifiers_are_unique_and_references_are_in_the_bundle(bundle: dict[str, Any]) -> None:
    urls = [entry["fullUrl"] for entry in bundle["entry"]]
    assert len(set(urls)) == len(urls)
    assert {found["device"]["reference"] for found in resources(bundle, "Observation")} <= set(urls)


def numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        for item in value.values():
            yield from numbers(item)
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, int | float):
        yield value


def test_every_number_is_finite(bundle: dict[str, Any]) -> None:
    found = list(numbers(bundle))
    assert len(found) > 500
    assert all(math.isfinite(number) for number in found)


def test_the_same_summary_gives_the_same_bytes(summary: SurgerySummary) -> None:
    assert export(summary) == export(summary)


def test_hostile_texts_are_single_lines_of_text(
    summary: SurgerySummary, validate: Validate, tmp_path: Path
) -> None:
    hostile = summary.model_copy(
        update={"reference": '"},{"x\x00\n<script>\u202e', "stages": summary.stages[2:]}
    )
    bundle = json.loads(export(hostile))
    assert resources(bundle, "Observation")[0]["subject"]["identifier"]["value"] == '"},{"x  <script> '
    assert errors(validate, bundle, tmp_path) == []


def test_a_surgery_without_stages_has_its_device_only(
    summary: SurgerySummary, validate: Validate, tmp_path: Path
) -> None:
    bundle = json.loads(export(summary.model_copy(update={"stages": []})))
    assert [entry["resource"]["resourceType"] for entry in bundle["entry"]] == ["Device"]
    assert errors(validate, bundle, tmp_path) == []
