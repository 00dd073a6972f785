"""Text for single-line fields."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from exports.text import ascii_line, single_line


@given(st.text())
def test_one_visible_line_of_the_same_length(text: str) -> None:
    line = single_line(text)
    assert len(line) == len(text)
    assert len(line.splitlines()) <= 1
    assert not set(line) & set(map(chr, [*range(32), *range(127, 160), 0x200B, 0x202E, 0x2028, 0x2029]))


@given(st.text())
def test_ascii(text: str) -> None:
    line = ascii_line(text)
    assert line.isascii()
    assert line.isprintable()


def test_visible_text_is_kept() -> None:
    assert single_line("Größe 𝔘 'x'") == "Größe 𝔘 'x'"
