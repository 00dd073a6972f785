from contract.spine import Share
from reports.attribution_table import attribution_table
from tests.contract.spine_results import change


def test_attribution_has_intervals_and_a_reason_where_there_is_none() -> None:
    whole = change(0, 2)
    found = attribution_table("POST", whole)
    ((subject, quantity, total, rotation, distraction, remainder),) = found.rows
    assert (subject, quantity, total.value, rotation.value, distraction.value, remainder) == (
        "curve 1",
        "cobb-fixed",
        "−23.3°",
        "−18.0°",
        "−5.1°",
        "−0.2°",
    )
    assert rotation.interval == "−20.0 to −16.0°"
    nothing = Share(value=None, sd=None, interval=None)
    part = whole.attribution[0].model_copy(
        update={"rotation": nothing, "reason": "the plane is not determined"}
    )
    found = attribution_table("POST", whole.model_copy(update={"attribution": [part]}))
    assert (found.rows[0][3].value, found.rows[0][3].mark) == ("–", "not measured")
    assert found.notes == ("curve 1: the plane is not determined",)
