"""Codes of the exports: vertebrae in SNOMED CT, and the private coding scheme of what SNOMED CT has no code for.

The code of a measure is the identifier of its definition, everywhere. docs/codes.md has the tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from spinewatch.spine.definitions import DEFINITIONS

SNOMED = "http://snomed.info/sct"
UCUM = "http://unitsofmeasure.org"
SCHEME = "99SPINEWATCH"
SCHEME_UID = "2.25.247279357656188659333359227015332606207"
SCHEME_URI = f"urn:oid:{SCHEME_UID}"
"""The private coding scheme: designator in DICOM, UID in both, URI in FHIR."""

COBB = "285285000"
STANDARD_DEVIATION = "386136009"
"""SNOMED CT codes of the Cobb angle and of a standard deviation."""

_MEANING_LENGTH = 64


@dataclass(frozen=True)
class Code:
    """A code with its meaning.

    Attributes
    ----------
    value
        The code.
    meaning
        Its meaning, at most 64 characters.
    """

    value: str
    meaning: str


VERTEBRAE: Mapping[str, Code] = MappingProxyType(
    {
        level: Code(value, f"{level} vertebra")
        for level, value in {
            "C1": "14806007", "C2": "39976000", "C3": "113205007", "C4": "5329002", "C5": "36978003",
            "C6": "36054005", "C7": "87391001",
            "T1": "64864005", "T2": "53733008", "T3": "1626008", "T4": "73071006", "T5": "56401006",
            "T6": "45296009", "T7": "62487009", "T8": "11068009", "T9": "82687006", "T10": "7610001",
            "T11": "12989004", "T12": "23215003",
            "L1": "66794005", "L2": "14293000", "L3": "36470004", "L4": "11994002", "L5": "49668003",
        }.items()
    }
)  # fmt: skip
"""SNOMED CT codes of the vertebrae that it has one for; T13, L6 and the sacral ones get a private code."""

COMPONENTS: Mapping[str, Code] = MappingProxyType(
    {
        code.value: code
        for code in (
            Code("pose", "Pose of the vertebra"),
            Code("motion", "Motion of the vertebra"),
            Code("position-x", "Position of the centroid, anterior"),
            Code("position-y", "Position of the centroid, left"),
            Code("position-z", "Position of the centroid, cephalad"),
            Code("coronal-tilt", "Coronal tilt, + left side up"),
            Code("sagittal-tilt", "Sagittal tilt"),
            Code("axial-rotation", "Axial rotation, + anterior side turned left"),
            Code("translation-x", "Displacement, anterior"),
            Code("translation-y", "Displacement, left"),
            Code("translation-z", "Displacement, cephalad"),
            Code("rotation-x", "Rotation vector about the anterior axis"),
            Code("rotation-y", "Rotation vector about the left axis"),
            Code("rotation-z", "Rotation vector about the cephalad axis"),
            Code("rotation-angle", "Angle of the rotation"),
            Code("derotation", "Rotation about the vertebra's own z axis"),
            Code("distraction", "Change of the length of the curve"),
        )
    }
)
"""What is given of a vertebra beside the measures."""

STATUSES: Mapping[str, Code] = MappingProxyType(
    {
        code.value: code
        for code in (
            Code("measured", "Measured"),
            Code("bracketed", "Bracketed: an end vertebra has no marker"),
            Code("interpolated", "Interpolated between marked vertebrae"),
            Code("assumed", "Assumed: depends on an assumed initial configuration"),
            Code("not_measured", "Not measured"),
        )
    }
)
"""How far a value is determined."""

DERIVATIONS: Mapping[str, Code] = MappingProxyType(
    {
        code.value: code
        for code in (
            Code("change", "Change since an earlier stage: later less earlier"),
            Code("by-rotation", "Part of the change that came with rotation"),
            Code("by-distraction", "Part of the change that came with distraction"),
            Code("remainder", "Part of the change that came with neither of the two"),
            Code("remaining", "What remains to the target: target less present"),
        )
    }
)
"""What a value is when it is not that of the stage itself."""

ITEMS: Mapping[str, Code] = MappingProxyType(
    {
        code.value: code
        for code in (
            Code("curve", "Curve of the spine"),
            Code("spine", "Spine"),
            Code("vertebra", "Vertebra"),
            Code("status", "How far the value is determined"),
            Code("since", "Stage that the change is counted from"),
            Code("reason", "Reason"),
            Code("assumed", "Depends on an assumed initial configuration"),
            Code("flag", "Flag: named doubt about the result"),
            Code("frame", "Coordinate system"),
            Code("reference-line", "Line that lateral translations are measured from"),
            Code("interval-low", "Lower end of the 95% interval"),
            Code("interval-high", "Upper end of the 95% interval"),
            Code("stereo-spine", "Optical stereo measurement of the spine"),
            Code("stage", "Stage of the surgery"),
            Code("derivation", "What the value is derived from"),
            Code("open-end", "End of the measured span, beyond which the curve may go on"),
        )
    }
)
"""Names of the other entries."""


SPINE = Code("421060004", "Structure of vertebral column")
"""SNOMED CT code of the whole spine."""


@dataclass(frozen=True)
class Site:
    """A vertebra as a finding site.

    Attributes
    ----------
    system
        URI of the coding system.
    designator
        Designator of the coding system in DICOM.
    code
        The code.
    """

    system: str
    designator: str
    code: Code


def site(level: str) -> Site:
    """Return the code of a vertebra.

    Parameters
    ----------
    level
        Canonical name.

    Returns
    -------
    Site
        In SNOMED CT, or in the private scheme where that has none.

    Examples
    --------
    >>> site("T1").code.value, site("L6").designator
    ('64864005', '99SPINEWATCH')
    """
    if level in VERTEBRAE:
        return Site(SNOMED, "SCT", VERTEBRAE[level])
    return Site(SCHEME_URI, SCHEME, Code(level, f"{level} vertebra"))


def definition_code(identifier: str) -> Code:
    """Return the private code of a definition.

    Parameters
    ----------
    identifier
        Identifier of the definition.

    Returns
    -------
    Code
        The identifier with its name, or with itself when the registry does not know it.

    Examples
    --------
    >>> definition_code("from-a-later-version").meaning
    'from-a-later-version'
    """
    known = DEFINITIONS.get(identifier)
    meaning = identifier if known is None else known.name
    return Code(identifier, meaning[:_MEANING_LENGTH])


def derived_code(code: Code, derivation: str | None) -> Code:
    """Return the private code of a value that is derived from others, which is another quantity than they are.

    Parameters
    ----------
    code
        Code of the quantity that it is derived from: of a definition or of `COMPONENTS`.
    derivation
        A code of `DERIVATIONS`; None for a value of the stage itself.

    Returns
    -------
    Code
        Both codes with a point between them; ``code`` itself without a derivation.

    Examples
    --------
    >>> derived_code(definition_code("cobb-fixed"), "change").value
    'cobb-fixed.change'
    """
    if derivation is None:
        return code
    ending = f": {derivation}"
    return Code(f"{code.value}.{derivation}", code.meaning[: _MEANING_LENGTH - len(ending)] + ending)
