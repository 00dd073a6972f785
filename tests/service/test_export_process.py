"""An export is made apart: the same file, and an end by name for what takes too much."""

from __future__ import annotations

from hashlib import sha256

import pytest

from contract.summary import SurgerySummary
from exports.formats import FORMATS, export_surgery
from reports.surgery import render_surgery
from service.export_process import EXPORT_LIMITS, ExportTooCostlyError, export_apart
from service.limited_process import ProcessLimits
from spinewatch.errors import SpinewatchError
from tests.contract.spine_results import summary as example

SUMMARY = example()
TEXT = SUMMARY.model_dump_json(by_alias=True)


@pytest.mark.parametrize(("name", "stage"), [*((name, None) for name in FORMATS), ("gltf", "PRE")])
def test_the_file_is_that_of_exporting_here(name: str, stage: str | None) -> None:
    here = export_surgery(SurgerySummary.model_validate_json(TEXT), name, stage)
    made = export_apart(TEXT, name, stage)
    with made.file:
        assert made.file.read() == here.content
    assert (made.media_type, made.file_name) == (here.media_type, here.file_name)
    assert (made.size, made.sha256) == (len(here.content), sha256(here.content).hexdigest())


def test_the_report_is_a_page_or_a_pdf() -> None:
    with export_apart(TEXT, "report-html").file as page:
        assert page.read().decode() == render_surgery(SurgerySummary.model_validate_json(TEXT))
    made = export_apart(TEXT, "report-pdf")
    with made.file:
        assert made.file.read(5) == b"%PDF-"
    assert made.file_name.endswith(".pdf")


@pytest.mark.parametrize(
    ("name", "stage", "code"),
    [
        ("gltf", "NEVER", "unknown-stage"),
        ("fhir", "PRE", "stage-not-selectable"),
        ("cd-rom", None, "unknown-format"),
    ],
)
def test_an_error_keeps_its_code_and_sentence(name: str, stage: str | None, code: str) -> None:
    with pytest.raises(SpinewatchError) as here:
        export_surgery(SUMMARY, name, stage)
    with pytest.raises(SpinewatchError) as apart:
        export_apart(TEXT, name, stage)
    assert apart.value.code == here.value.code == code
    assert str(apart.value) == str(here.value)


@pytest.mark.parametrize("name", ["dicom-sr", "fhir"])
def test_a_surgery_of_too_many_stages_is_named(name: str) -> None:
    stages = [
        stage.model_copy(update={"name": f"{stage.name}-{number}"})
        for number in range(200)
        for stage in SUMMARY.stages
    ]
    large = SUMMARY.model_copy(update={"stages": stages}).model_dump_json(by_alias=True)
    little = ProcessLimits(1, EXPORT_LIMITS.memory_bytes // 3, EXPORT_LIMITS.seconds)
    with pytest.raises(ExportTooCostlyError, match=f"too many stages for {name}") as error:
        export_apart(large, name, None, little)
    assert error.value.code == "export-too-costly"
