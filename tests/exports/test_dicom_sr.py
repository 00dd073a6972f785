import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pydicom
import pytest

from contract.spine import StageSpine
from contract.summary import SurgerySummary
from exports.dicom_sr import NothingToReportError, export
from exports.text import single_line
from tests.contract.spine_results import measure, stage_spine
from tests.paths import PROJECT

HOSTILE = ("a\\b", "x" * 65, "case\r\nDoe^John", " padded ", "é" * 40)


@pytest.fixture(scope="module")
def file(summary: SurgerySummary) -> bytes:
    return export(summary)


def complaints(file: bytes, folder: Path) -> list[str]:
    """What dciodvfy (Debian: dicom3tools) finds wrong."""
    if shutil.which("dciodvfy") is None:
        pytest.skip("dciodvfy is not installed (Debian: apt install dicom3tools)")
    path = folder / "report.dcm"
    path.write_bytes(file)
    run = subprocess.run(["dciodvfy", path], check=False, capture_output=True, text=True)
    assert "ComprehensiveSR" in run.stdout + run.stderr
    return [line for line in (run.stdout + run.stderr).splitlines() if line.startswith(("Error", "Abort"))]


def test_dciodvfy_finds_no_error(file: bytes, tmp_path: Path) -> None:
    assert complaints(file, tmp_path) == []


def test_dciodvfy_does_find_errors(file: bytes, tmp_path: Path) -> None:
    document = pydicom.dcmread(io.BytesIO(file))
    document.CompletionFlag = "DONE"
    del document.VerificationFlag
    broken = io.BytesIO()
    document.save_as(broken)
    assert len(complaints(broken.getvalue(), tmp_path)) >= 2


def test_dciodvfy_finds_no_error_in_levels_and_measures_without_a_standard_code(
    summary: SurgerySummary, tmp_path: Path
) -> None:
    spine = stage_spine(0)
    renamed = [state.model_copy(update={"vertebra": "L6"}) for state in spine.vertebrae[-1:]]
    unknown = [m.model_copy(update={"definition": "a-measure-of-a-later-version"}) for m in spine.measures]
    changed = spine.model_copy(update={"vertebrae": [*spine.vertebrae[:-1], *renamed], "measures": unknown})
    assert complaints(export(with_spine(summary, changed)), tmp_path) == []


def with_spine(summary: SurgerySummary, spine: StageSpine) -> SurgerySummary:
    stage = summary.stages[0].model_copy(update={"spine": spine})
    return summary.model_copy(update={"stages": [stage]})


def test_the_same_summary_gives_the_same_file_and_another_content_another_instance(
    summary: SurgerySummary, file: bytes
) -> None:
    assert export(summary) == file
    other = pydicom.dcmread(io.BytesIO(export(summary.model_copy(update={"stages": summary.stages[:2]}))))
    document = pydicom.dcmread(io.BytesIO(file))
    assert other.SOPInstanceUID != document.SOPInstanceUID
    assert (other.StudyInstanceUID, other.SeriesInstanceUID) == (
        document.StudyInstanceUID,
        document.SeriesInstanceUID,
    )


def test_no_person_is_named_and_the_patient_is_the_case_number(file: bytes) -> None:
    document = pydicom.dcmread(io.BytesIO(file))
    assert document.PatientID == "2026-0417"
    assert not document.PatientName
    assert not document.PatientBirthDate
    assert not document.PatientSex
    assert document.PreliminaryFlag == "PRELIMINARY"
    assert document.VerificationFlag == "UNVERIFIED"
    assert document.CompletionFlag == "COMPLETE"
    assert "CurrentRequestedProcedureEvidenceSequence" not in document
    assert document.TimezoneOffsetFromUTC == "+0000"
    assert document.ContentDate == "20261121"


@pytest.mark.parametrize("reference", HOSTILE)
def test_a_case_number_that_is_no_patient_id_is_replaced_by_the_surgerys_identifier(
    summary: SurgerySummary, reference: str, tmp_path: Path
) -> None:
    short = summary.model_copy(update={"reference": reference, "stages": summary.stages[:1]})
    file = export(short)
    assert pydicom.dcmread(io.BytesIO(file)).PatientID == summary.surgery_id
    assert complaints(file, tmp_path) == []


def test_other_scripts_are_kept(summary: SurgerySummary, tmp_path: Path) -> None:
    file = export(summary.model_copy(update={"reference": "Fall Grün 7", "stages": summary.stages[:1]}))
    assert pydicom.dcmread(io.BytesIO(file)).PatientID == "Fall Grün 7"
    assert complaints(file, tmp_path) == []


def test_numbers_of_any_length_are_valid_and_exact(summary: SurgerySummary, tmp_path: Path) -> None:
    values = [1e-12, -179.99999999999997, 0.1 + 0.2, -0.0, 123456789.123456789, 1 / 3]
    measures = [measure(f"measure-{number}", value) for number, value in enumerate(values)]
    file = export(with_spine(summary, stage_spine(0).model_copy(update={"measures": measures})))
    assert complaints(file, tmp_path) == []
    found = {
        item.ConceptNameCodeSequence[0].get("CodeValue"): item.MeasuredValueSequence[0].get(
            "FloatingPointValue"
        )
        for item in numbers(pydicom.dcmread(io.BytesIO(file)))
    }
    assert [found[f"measure-{number}"] for number in range(len(values))] == values


def numbers(item: pydicom.Dataset) -> Iterator[pydicom.Dataset]:
    """Yield the items of type NUM below an item."""
    for child in item.get("ContentSequence", ()):
        if child.ValueType == "NUM":
            yield child
        yield from numbers(child)


def test_control_characters_in_texts_do_no_harm(summary: SurgerySummary, tmp_path: Path) -> None:
    reason = "line\nbreak\x07 \u202e and a very long reason " + "x" * 2000
    spine = stage_spine(0)
    measures = [measure.model_copy(update={"reason": reason}) for measure in spine.measures]
    file = export(with_spine(summary, spine.model_copy(update={"measures": measures})))
    assert complaints(file, tmp_path) == []
    assert single_line(reason) in str(pydicom.dcmread(io.BytesIO(file)).to_json_dict())


def test_a_surgery_without_stages_has_nothing_to_report(summary: SurgerySummary) -> None:
    with pytest.raises(NothingToReportError, match="has no stage"):
        export(summary.model_copy(update={"stages": []}))


def test_without_highdicom_the_error_says_what_to_install() -> None:
    script = (
        "import sys; sys.modules['highdicom'] = None\n"
        "from exports.dicom_sr import export\n"
        "from spinewatch.errors import MissingPackageError\n"
        "from tests.contract.spine_results import summary\n"
        "try: export(summary())\n"
        "except MissingPackageError as error: print(error)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=PROJECT, check=True, capture_output=True, text=True
    )
    assert run.stdout == "The DICOM export needs highdicom; install it: pip install spinewatch[dicom]\n"
