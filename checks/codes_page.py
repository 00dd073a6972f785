"""docs/codes.md from the codes of the exports: ``python -m checks.codes_page`` compares, ``--write`` writes it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from exports.codes import (
    COBB,
    COMPONENTS,
    DERIVATIONS,
    ITEMS,
    SCHEME,
    SCHEME_URI,
    STATUSES,
    VERTEBRAE,
    Code,
    definition_code,
    derived_code,
)

_EXAMPLE = derived_code(definition_code("cobb-fixed"), "change").value

PAGE = Path(__file__).parents[1] / "docs" / "codes.md"

_HEAD = f"""\
# Codes of the exports

The DICOM structured report and the FHIR bundle code what they hold. What SNOMED CT has a code for has that: the
Cobb angle ({COBB}), the vertebrae below, the standard deviation (386136009), the measurement method (370129005),
and how far the 95% interval reaches above (371886008) and below (371885007) the value. Units are UCUM: `deg` and `mm`.

Everything else has a code of Spinewatch's own scheme: `{SCHEME}` in DICOM, in FHIR
`{SCHEME_URI}`. A measure's code is the identifier of its definition
([measures.md](measures.md)); the Cobb angle has it as its method, because SNOMED CT does not tell the fixed from the
selected end vertebrae. Only an angle of a stage itself is coded as a Cobb angle in FHIR: a derived value (a change, a
part of one, or what remains to the target) is another quantity, and its code is that of what it is derived from, a
point, and the code of the derivation below, such as `{_EXAMPLE}`. DICOM has the derivation as a modifier of the name
(121401). In DICOM, a code of more than 16 characters is a Long Code Value. A flag's code in FHIR is that
of [flags.md](flags.md). A vertebra that is not below, such as L6 or S1, has its name as code.

What was not measured is not written as a number: in DICOM it is an evaluation with the value `not_measured` and a
reason, in FHIR an Observation with a dataAbsentReason. An Observation is `final` when its value is measured, and
`preliminary` when it is bracketed, interpolated or assumed, or its curve may go on beyond the measured span
(`open-end`).

This page is generated from `exports/codes.py` by `python -m checks.codes_page --write`.
"""

_TABLES: Sequence[tuple[str, Mapping[str, Code]]] = (
    ("Of a vertebra", COMPONENTS),
    ("How far a value is determined", STATUSES),
    ("Derived values", DERIVATIONS),
    ("Other entries", ITEMS),
    ("Vertebrae (SNOMED CT)", VERTEBRAE),
)


def page() -> str:
    """Return the text of docs/codes.md."""
    parts = [_HEAD]
    for title, table in _TABLES:
        rows = [f"| `{code.value}` | {code.meaning} |" for code in table.values()]
        parts.append("\n".join([f"## {title}\n", "| code | meaning |", "|---|---|", *rows]) + "\n")
    return "\n".join(parts)


def main(arguments: Sequence[str]) -> int:
    """Write the page, or return 1 when the committed one differs from the codes."""
    if "--write" in arguments:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    if PAGE.exists() and PAGE.read_text(encoding="utf-8") == page():
        return 0
    sys.stderr.write(
        "docs/codes.md differs from exports/codes.py; run: python -m checks.codes_page --write\n"
    )
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
