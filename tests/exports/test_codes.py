import pytest
from pydicom.sr.codedict import codes

from exports.codes import (
    COBB,
    COMPONENTS,
    DERIVATIONS,
    ITEMS,
    SCHEME,
    SCHEME_UID,
    SCHEME_URI,
    SPINE,
    STANDARD_DEVIATION,
    STATUSES,
    VERTEBRAE,
    definition_code,
    derived_code,
    site,
)
from spinewatch.levels import anatomical_sequence
from spinewatch.spine.definitions import DEFINITIONS

PRIVATE = (COMPONENTS, STATUSES, DERIVATIONS, ITEMS)


@pytest.mark.parametrize("level", [level for level in anatomical_sequence() if level != "S1"])
def test_every_vertebra_has_the_code_of_pydicoms_dictionary(level: str) -> None:
    known = getattr(codes.SCT, f"{level}Vertebra")
    assert (VERTEBRAE[level].value, VERTEBRAE[level].meaning) == (known.value, known.meaning)


def test_the_other_snomed_codes_are_those_of_pydicoms_dictionary() -> None:
    assert codes.SCT.CobbAngle.value == COBB
    assert codes.SCT.StandardDeviation.value == STANDARD_DEVIATION
    assert codes.SCT.StructureOfVertebralColumn.value == SPINE.value


def test_a_vertebra_without_a_snomed_code_has_a_private_one() -> None:
    assert (site("L6").designator, site("L6").system, site("L6").code.value) == (SCHEME, SCHEME_URI, "L6")
    assert (site("T1").designator, site("T1").system, site("T1").code.value) == (
        "SCT",
        "http://snomed.info/sct",
        "64864005",
    )


def test_private_codes_are_found_by_their_value_and_fit_in_dicom() -> None:
    for table in PRIVATE:
        assert all(code.value == key and 0 < len(code.meaning) <= 64 for key, code in table.items())
    assert len(SCHEME) <= 16
    assert len(SCHEME_UID) <= 64


def test_definitions_are_coded_by_their_identifier() -> None:
    for identifier, definition in DEFINITIONS.items():
        code = definition_code(identifier)
        assert code.value == identifier
        assert code.meaning == definition.name[:64]
    assert definition_code("from-a-later-version").meaning == "from-a-later-version"


def test_a_derived_value_has_a_code_of_its_own_that_fits() -> None:
    codes_of = [*COMPONENTS.values(), *(definition_code(identifier) for identifier in DEFINITIONS)]
    made = [derived_code(code, derivation) for code in codes_of for derivation in DERIVATIONS]
    known = {
        code.value for table in (*PRIVATE, {code.value: code for code in codes_of}) for code in table.values()
    }
    assert not {code.value for code in made} & known
    assert all(len(code.meaning) <= 64 for code in made)
    assert derived_code(definition_code("kyphosis"), "change").meaning == "Kyphosis: change"
    assert derived_code(definition_code("kyphosis"), None) == definition_code("kyphosis")
