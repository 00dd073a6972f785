from contract.summary import SurgerySummary
from exports.gltf_extras import asset_extras, level_extras, scene_extras, stage_extras
from tests.exports.hostile import stage_without_spine, without_spines


def test_a_stage_without_a_spine_is_named_with_its_reason_and_flags(summary: SurgerySummary) -> None:
    lost = stage_without_spine(summary)
    found = scene_extras([summary.stages[0], lost])
    assert found["shown_at_rest"] == "PRE"
    assert found["stages"][1] == {
        "stage": "POST",
        "take": 1,
        "flags": ["triad-count-low"],
        "spine_reason": "the reference triad L1 has no pose in stage POST",
    }


def test_a_scene_without_any_spine_shows_no_stage() -> None:
    found = scene_extras(without_spines().stages)
    assert found["shown_at_rest"] is None
    assert {stage["spine_reason"] for stage in found["stages"]} == {"no setup"}


def test_curves_have_their_open_ends(summary: SurgerySummary) -> None:
    (curve,) = stage_extras(summary.stages[1])["curves"]
    assert (curve["name"], curve["apex"], curve["open_ends"]) == ("curve 1", "T9", ["L1"])


def test_a_level_that_the_last_stage_does_not_have_has_no_origin(summary: SurgerySummary) -> None:
    spine = summary.stages[0].spine
    assert spine is not None
    found = level_extras("T9", ["PRE", "INTER"], [spine.vertebrae[4], None])
    assert found["origin"] is None
    assert [stage["stage"] for stage in found["stages"]] == ["PRE"]


def test_the_file_names_its_axes(summary: SurgerySummary) -> None:
    assert asset_extras(summary)["axes"] == "x to the patient's left, y cephalad, z anterior; metres"
