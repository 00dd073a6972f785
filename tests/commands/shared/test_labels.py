import pytest
from hypothesis import given
from hypothesis import strategies as st

from commands.shared.labels import parse_extra_levels, parse_labels
from spinewatch.errors import ParameterError
from spinewatch.levels import anatomical_sequence

SEQUENCE = anatomical_sequence()
vertebrae = st.lists(st.sampled_from(SEQUENCE), min_size=1, unique=True).map(
    lambda names: sorted(names, key=SEQUENCE.index)
)


@given(vertebrae, st.booleans())
def test_distinct_names_are_kept_in_order(names: list[str], counted: bool) -> None:
    count = len(names) if counted else None
    assert parse_labels(", ".join(names), count) == tuple(names)


def test_no_labels_are_no_names() -> None:
    assert parse_labels(None, 3) == ()


@pytest.mark.parametrize(
    ("labels", "triads", "words"),
    [
        (None, 0, "1 or more"),
        ("", None, "empty name"),
        ("L1,,T9", None, "empty name"),
        ("L1,L1", None, "twice"),
        ("L1,T9", 3, "2 names"),
        ("L1,l01", None, "twice"),
        ("L1,T9,T11", None, "order"),
        ("L9", None, "L9"),
        ("T13", None, "T13"),
    ],
)
def test_a_contradiction_is_named(labels: str | None, triads: int | None, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        parse_labels(labels, triads)


def test_extra_levels_may_be_named() -> None:
    extra = parse_extra_levels(" t13,L6")
    assert extra == ("T13", "L6")
    assert parse_labels("L6,T13", 2, extra) == ("L6", "T13")
    assert parse_extra_levels(None) == ()


@pytest.mark.parametrize(
    ("levels", "words"), [("", "empty name"), ("T14", "T14"), ("T13,", "--extra-levels")]
)
def test_an_extra_level_that_no_spine_has_is_named(levels: str, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        parse_extra_levels(levels)


def test_an_extra_level_is_named_once() -> None:
    assert parse_extra_levels("t13, L6") == ("T13", "L6")
    with pytest.raises(ParameterError, match="T13 is named twice"):
        parse_extra_levels("T13,t13")
