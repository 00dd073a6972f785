"""Every standard that a surgery can be written in, by the name that the API and the command line use."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from inspect import signature

from contract.summary import SurgerySummary
from spinewatch.errors import ParameterError

FORMATS: Mapping[str, str] = {
    "slicer-markups": "slicer_markups",
    "slicer-transforms": "slicer_transforms",
    "gltf": "gltf",
    "csv": "csv_tables",
    "json": "json_document",
    "fhir": "fhir",
    "dicom-sr": "dicom_sr",
}
"""Module of each format."""


class UnknownFormatError(ParameterError):
    """There is no export of that name."""

    code = "unknown-format"


class StageNotSelectableError(ParameterError):
    """A stage was named for a format that holds the whole surgery."""

    code = "stage-not-selectable"


@dataclass(frozen=True)
class Export:
    """A surgery in one format.

    Attributes
    ----------
    content
        The file.
    media_type
        Its media type.
    file_name
        A name for it, of ASCII letters, digits, dots and dashes.
    """

    content: bytes
    media_type: str
    file_name: str


def export_surgery(summary: SurgerySummary, name: str, stage: str | None = None) -> Export:
    """Return a surgery in one format.

    Parameters
    ----------
    summary
        The surgery.
    name
        Name of the format.
    stage
        Name of a stage to export alone, for the formats that allow it; None for all.

    Returns
    -------
    Export
        The file.

    Raises
    ------
    UnknownFormatError
        There is no such format.
    StageNotSelectableError
        The format holds the whole surgery.
    MissingPackageError
        The format needs a package that is not installed.
    """
    if name not in FORMATS:
        raise UnknownFormatError(f"there is no export of that name; choose one of {', '.join(FORMATS)}")
    module = import_module(f"exports.{FORMATS[name]}")
    options = {}
    if stage is not None:
        if "stage" not in signature(module.export).parameters:
            raise StageNotSelectableError(f"{name} holds the whole surgery; leave the stage out")
        options["stage"] = stage
    name_of_file = file_name(summary, module.FILE_SUFFIX, stage)
    return Export(module.export(summary, **options), module.MEDIA_TYPE, name_of_file)


def file_name(summary: SurgerySummary, suffix: str, stage: str | None = None) -> str:
    """Return a name for a file about a surgery that every system allows.

    Parameters
    ----------
    summary
        The surgery.
    suffix
        End of the name, with its dot.
    stage
        Name of the stage that the file holds, None for all.

    Returns
    -------
    str
        The case number and the stage in ASCII letters, digits, dots and dashes, and the suffix.
    """
    parts = [re.sub(r"[^A-Za-z0-9._-]+", "-", part) for part in (summary.reference, stage or "")]
    stem = "-".join(part for part in parts if part).strip("-.")
    return f"{stem[:100] or 'surgery'}{suffix}"
