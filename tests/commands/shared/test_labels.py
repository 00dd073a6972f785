import pytest
from hypothesis import given
from hypothesis import strategies as st

from commands.shared.labels import parse_labels
from spinewatch.errors import ParameterError

vertebrae = st.lists(st.from_regex(r"[CTL][1-9]", fullmatch=True), min_size=1, unique=True)


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
    ],
)
def test_a_contradiction_is_named(labels: str | None, triads: int | None, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        parse_labels(labels, triads)
