import pytest

from spinewatch.spine.definitions import DEFINITIONS, MeasureDefinition
from spinewatch.spine.measure_functions import FORMULAS


def test_every_measure_has_a_formula_and_every_formula_a_definition() -> None:
    assert set(DEFINITIONS) == set(FORMULAS)


@pytest.mark.parametrize("definition", DEFINITIONS.values(), ids=list(DEFINITIONS))
def test_a_definition_is_complete(definition: MeasureDefinition) -> None:
    assert definition.unit in {"deg", "mm"}
    assert all((definition.name, definition.formula, definition.sign, definition.reference))
    assert "|" not in definition.formula + definition.reference


def test_the_units_of_lengths() -> None:
    lengths = {name for name, definition in DEFINITIONS.items() if definition.unit == "mm"}
    assert lengths == {"apical-translation", "coronal-balance", "lateral-displacement"}
