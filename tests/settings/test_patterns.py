import time

import pytest

from settings.patterns import LinearPattern

SLOW = [
    ("(a+)+$", "a"),
    ("KH-([0-9]+/?)+", "1"),
    ("(a|a)*b", "a"),
    ("(?:a|ab|b)*c", "ab"),
    ("(a?){64}a{64}", "a"),
    ("a*a*a*a*a*a*a*b", "a"),
]
"""Patterns that the module ``re`` tries in more ways than can be counted, and what of."""


@pytest.mark.parametrize(("pattern", "part"), SLOW)
def test_no_text_keeps_a_pattern_busy(pattern: str, part: str) -> None:
    start = time.process_time()
    assert not LinearPattern(pattern).fullmatch(part * 2000 + "!")
    assert time.process_time() - start < 5


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        ("K[0-9]{4}", "K0417"),
        (r"(?i:KH)[-/ ]?\d{2}[./]\d{1,6}[a-z]?", "kh-26/417a"),
        ("[0-9]{1,6}(-[0-9]{1,6})?", "17-4"),
        ("case [0-9]+|op [0-9]+", "op 12"),
    ],
)
def test_the_whole_text_must_match(pattern: str, text: str) -> None:
    found = LinearPattern(pattern)
    assert found.pattern == pattern
    assert found.fullmatch(text)
    assert not any(found.fullmatch(other) for other in (f"x{text}", f"{text}!", f"{text}\n", ""))


@pytest.mark.parametrize("pattern", ["(", "a)|(b", "(?=a)a", r"(a)\1", "a{1000000}{1000000}"])
def test_what_cannot_be_matched_so_is_refused(pattern: str) -> None:
    with pytest.raises(ValueError, match="not a regular expression that can be used here"):
        LinearPattern(pattern)
