import re
import time

import pytest

from settings import OPAQUE_REFERENCE
from settings.patterns import MAX_TEXT, require_bounded

SLOW = [
    ("(a+)+$", "a"),
    ("KH-([0-9]+/?)+", "1"),
    ("(a|a)*b", "a"),
    ("(?:a|ab|b)*c", "ab"),
    ("(a?){64}a{64}", "a"),
    ("a*a*a*a*a*a*a*b", "a"),
    ("(?=(a+)+b)a", "a"),
    ("(?>(a+)+b)", "a"),
    ("(?:(a+)+b)++", "a"),
    ("(?:(a+)+b|c)?", "a"),
    ("(x)?(?(1)b|(a+)+c)", "a"),
]
USUAL = [
    OPAQUE_REFERENCE,
    ".+",
    "K[0-9]{4}",
    r"(?i:KH)[-/ ]?\d{2}[./]\d{1,6}[a-z]?",
    "[A-Z]+-[0-9]+-[0-9]+-[0-9]+",
    "[0-9]{1,6}(-[0-9]{1,6})?(-[0-9]{1,6})?",
    "[0-9]++(?:-[0-9]++)*",
    r"(\d+)-\1",
    "(?!.*--)[0-9-]+",
    "(?:case|op) [0-9]{1,6}",
    "a{1000}",
]


@pytest.mark.parametrize("pattern", [pattern for pattern, _ in SLOW])
def test_a_pattern_that_a_text_keeps_busy_is_refused(pattern: str) -> None:
    with pytest.raises(ValueError, match=r"possessive .*, or give them upper limits"):
        require_bounded(pattern)


@pytest.mark.parametrize("pattern", USUAL)
def test_a_pattern_of_a_site_is_taken_and_no_text_keeps_it_busy(pattern: str) -> None:
    require_bounded(pattern)
    compiled = re.compile(pattern)
    start = time.process_time()
    for part in ("a", "1", "A", "ab", "a1", "1-", "A-", "case ", "KH-1"):
        compiled.fullmatch((part * MAX_TEXT)[: MAX_TEXT - 1] + "!")
    assert time.process_time() - start < 10


def test_the_advice_is_a_way_out() -> None:
    for pattern in ("(a++)+$", "(a+){1,2}$", "KH-(?:[0-9]++/?+)+"):
        require_bounded(pattern)
