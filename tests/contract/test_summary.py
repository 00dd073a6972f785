from contract.summary import SPINE_NOT_COMPUTED, SurgerySummary
from tests.contract.spine_results import stage_spine, summary


def test_a_summary_passes_through_json_to_the_last_bit() -> None:
    made = summary()
    again = SurgerySummary.model_validate_json(made.model_dump_json())
    assert again == made
    assert [stage.spine for stage in again.stages[:3]] == [stage_spine(number) for number in range(3)]
    assert (again.stages[3].spine, again.stages[3].spine_reason) == (None, "the stage was not measured")
    assert SPINE_NOT_COMPUTED
