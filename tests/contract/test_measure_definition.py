from contract.measure_definition import measure_definitions
from spinewatch.spine.definitions import DEFINITIONS


def test_the_definitions_are_those_of_the_registry_in_its_order() -> None:
    listed = measure_definitions().items
    assert [item.id for item in listed] == list(DEFINITIONS)
    for item in listed:
        definition = DEFINITIONS[item.id]
        assert item.model_dump() == {name: getattr(definition, name) for name in type(item).model_fields}
        assert item.unit in {"deg", "mm"}
