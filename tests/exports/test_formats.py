import re
from pathlib import Path

import pytest

from exports.formats import (
    FORMATS,
    StageNotSelectableError,
    UnknownFormatError,
    export_surgery,
    file_name,
)
from spinewatch.errors import MissingPackageError
from tests.contract.spine_results import summary


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_a_media_type_and_a_file_name(name: str) -> None:
    try:
        made = export_surgery(summary(), name)
    except MissingPackageError as error:
        pytest.skip(str(error))
    assert made.content
    assert re.fullmatch(r"[a-z]+/[a-z0-9.+-]+(; charset=utf-8)?", made.media_type)
    assert re.fullmatch(r"2026-0417\.[a-z.]+", made.file_name)


def test_every_module_that_exports_is_a_format() -> None:
    import exports  # noqa: PLC0415

    found = {
        path.stem
        for path in Path(exports.__file__ or "").parent.glob("*.py")
        if "\ndef export(" in path.read_text() and "\nMEDIA_TYPE" in path.read_text()
    }
    assert found - {"audit_fhir"} == set(FORMATS.values())  # the audit belongs to no surgery


def test_one_stage_alone() -> None:
    made = export_surgery(summary(), "gltf", "PRE")
    assert made.file_name == "2026-0417-PRE.glb"
    assert made.content != export_surgery(summary(), "gltf").content
    with pytest.raises(StageNotSelectableError, match="fhir holds the whole surgery"):
        export_surgery(summary(), "fhir", "PRE")


def test_a_format_that_there_is_not() -> None:
    with pytest.raises(UnknownFormatError, match="choose one of slicer-markups"):
        export_surgery(summary(), "../gltf")


@pytest.mark.parametrize(
    ("reference", "expected"),
    [
        ("2026-0417", "2026-0417.csv"),
        ("../../etc/passwd", "etc-passwd.csv"),
        ('a"b\r\nc', "a-b-c.csv"),
        ("\u202e", "surgery.csv"),
        ("x" * 300, "x" * 100 + ".csv"),
    ],
)
def test_a_file_name_that_every_system_allows(reference: str, expected: str) -> None:
    given = summary().model_copy(update={"reference": reference})
    assert file_name(given, ".csv") == expected
