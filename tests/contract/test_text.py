import re

import pytest

from contract.text import NamedReferenceError, require_opaque, visible


@pytest.mark.parametrize("text", ["case 17", "Müller-Rig 2", "左", "a\u0301", ""])
def test_a_visible_text_stays_as_it_is(text: str) -> None:
    assert visible(text) == text


@pytest.mark.parametrize(
    "text",
    [
        "a\x00",
        "a\nb",
        "\x1b[31m",
        "a\u202eb",
        "a\u200bb",
        "\ufeffa",
        "a\u2028b",
        "\ue000",
        "a\x9f",
        " a",
        "a\u00a0",
    ],
)
def test_a_text_that_hides_something_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"invisible|space"):
        visible(text)


def test_a_reference_must_match_as_a_whole() -> None:
    pattern = re.compile("[0-9]+")
    require_opaque("17", pattern.fullmatch)
    for reference in ("17 Anna", "17\n", ""):
        with pytest.raises(NamedReferenceError, match="SPINEWATCH_REFERENCE_PATTERN"):
            require_opaque(reference, pattern.fullmatch)
