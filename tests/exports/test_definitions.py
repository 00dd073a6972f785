"""The definitions that an export refers to."""

from __future__ import annotations

from contract.summary import SurgerySummary
from exports.definitions import definition_table, definitions_of
from exports.selection import selected_spines
from spinewatch.spine.definitions import DEFINITIONS


def test_measures_changes_attribution_and_targets_are_looked_through(summary: SurgerySummary) -> None:
    spines = selected_spines(summary, "INTER")
    assert definitions_of(spines) == [
        "apical-rotation", "apical-translation", "cobb-fixed", "cobb-reselected", "kyphosis", "lordosis"
    ]  # fmt: skip
    bare = spines[0].model_copy(update={"measures": [], "target_measures": None, "since_previous": None})
    assert definitions_of([bare]) == ["apical-translation", "cobb-fixed", "kyphosis"]
    change = bare.since_baseline
    assert change is not None
    only = bare.model_copy(update={"since_baseline": change.model_copy(update={"measures": []})})
    assert definitions_of([only]) == ["apical-translation", "cobb-fixed"]
    assert definitions_of([]) == []


def test_the_table_says_what_the_registry_says() -> None:
    table = definition_table(DEFINITIONS)
    assert set(table) == set(DEFINITIONS)
    for identifier, known in DEFINITIONS.items():
        assert table[identifier] == {
            "name": known.name, "unit": known.unit, "formula": known.formula, "sign": known.sign,
            "reference": known.reference,
        }  # fmt: skip
