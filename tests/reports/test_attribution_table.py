from contract.spine import Share
from reports.attribution_table import attribution_table
from tests.contract.spine_results import change


def test_attribution_has_intervals_and_a_reason_where_there_is_none() -> None:
    whole = change(0, 2)
    found = attribution_table("POST", whole)
    (subject, quantity, total, rotation, distraction, remainder), apex = found.rows
    assert (subject, quantity, total.value, rotation.value, distraction.value, remainder.value) == (
        "curve 1",
        "cobb-fixed",
        "−23.3°",
        "−18.0°",
        "−5.1°",
        "−0.2°",
    )
    assert (rotation.interval, rotation.mark) == ("−20.0 to −16.0°", "")
    assert (remainder.interval, remainder.mark) == ("−0.4 to 0.0°", "")
    assert (apex[1], apex[2].mark, apex[3].mark) == ("apical-translation", "bracketed", "bracketed")
    assert found.notes == ("curve 1: T8 has no marker",)
    nothing = Share(value=None, sd=None, interval=None)
    part = whole.attribution[0].model_copy(
        update={"rotation": nothing, "reason": "the plane is not determined"}
    )
    found = attribution_table("POST", whole.model_copy(update={"attribution": [part]}))
    assert (found.rows[0][3].value, found.rows[0][3].mark) == ("–", "not measured")
    assert found.notes == ("curve 1: the plane is not determined",)


def test_what_is_assumed_says_so() -> None:
    whole = change(0, 2)
    parts = [part.model_copy(update={"assumed": True}) for part in whole.attribution]
    found = attribution_table("POST", whole.model_copy(update={"attribution": parts}))
    assert [row[3].mark for row in found.rows] == ["assumed", "bracketed, assumed"]
