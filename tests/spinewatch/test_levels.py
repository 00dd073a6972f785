import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import ParameterError
from spinewatch.levels import (
    ExtraLevelError,
    LevelError,
    anatomical_sequence,
    canonical_name,
    extra_level_names,
    level_numbers,
    vertebra_names,
)

SEQUENCE = anatomical_sequence()


def test_the_sequence_has_the_vertebrae_of_a_usual_spine() -> None:
    assert len(SEQUENCE) == 7 + 12 + 5 + 1
    assert (SEQUENCE[0], SEQUENCE[7], SEQUENCE[19], SEQUENCE[-1]) == ("C1", "T1", "L1", "S1")


def test_extra_levels_continue_their_region() -> None:
    longer = anatomical_sequence(["t13", "L6", "S2"])
    assert [name for name in longer if name not in SEQUENCE] == ["T13", "L6", "S2"]
    assert longer.index("T13") == longer.index("L1") - 1
    assert longer[-3:] == ("L6", "S1", "S2")
    assert anatomical_sequence(["L5"]) == SEQUENCE


@pytest.mark.parametrize("extra", ["T14", "C8", "S3", "L7", "rib", ""])
def test_an_extra_level_that_no_spine_has_is_refused(extra: str) -> None:
    with pytest.raises(LevelError, match="extra level"):
        anatomical_sequence([extra])


@given(st.sets(st.sampled_from(SEQUENCE), min_size=1), st.booleans(), st.booleans())
def test_names_in_order_are_accepted_in_either_direction_and_any_spelling(
    names: set[str], upwards: bool, lower: bool
) -> None:
    ordered = sorted(names, key=SEQUENCE.index, reverse=upwards)
    spelled = [f" {name[0]}0{name[1:]}".lower() if lower else name for name in ordered]
    assert vertebra_names(spelled) == tuple(ordered)
    numbers = level_numbers(ordered)
    assert [SEQUENCE[number] for number in numbers] == ordered


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("L1,T9,T11,T7", "not in the order of the spine; .* T7,T9,T11,L1 or reversed"),
        ("T9,L1,T7,T11", "order"),
        ("L9,T7", "^L9 is not a vertebra of C1 to C7"),
        ("T77", "T77"),
        ("C0", "C0"),
        ("S4,L1", "S4 .* extra level"),
        ("T13,T12", "T13 .* extra level"),
        ("1L", "1L"),
        ("L1,rib", "rib"),
        ("L1,l1,T9", "vertebra L1 is named twice"),
        ("T9,T09", "vertebra T9 is named twice"),
        ("L1,T9,L1", "twice"),
        ("T9,L\u0661", "number 2 is not a vertebra"),
        ("L1" * 99, "number 1 is"),
        ("L1\x1b[2J", "number 1 is"),
    ],
)
def test_names_that_no_spine_has_are_refused_by_name(names: str, words: str) -> None:
    with pytest.raises(LevelError, match=words) as refusal:
        vertebra_names(names.split(","))
    assert isinstance(refusal.value, ParameterError)
    assert refusal.value.code == "invalid-levels"


def test_a_declared_level_may_be_named() -> None:
    assert vertebra_names(["L1", "T13", "T12"], ["T13"]) == ("L1", "T13", "T12")


def test_what_is_no_name_keeps_its_spelling() -> None:
    assert [canonical_name(name) for name in ("t09", " c1", "Rib", "C00")] == ["T9", "C1", "Rib", "C00"]


def test_extra_levels_are_declared_once_and_continue_their_region() -> None:
    assert extra_level_names(["t13", "L06"]) == ("T13", "L6")
    with pytest.raises(ExtraLevelError, match="L6 is named twice") as refusal:
        extra_level_names(["L6", "T13", "L06"])
    assert refusal.value.index == 2
    with pytest.raises(ExtraLevelError, match="does not continue"):
        extra_level_names(["L7"])
