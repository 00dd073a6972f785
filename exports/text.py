"""Text that others typed, made safe for single-line fields."""

from __future__ import annotations

import unicodedata

_HIDDEN = {"Cc", "Cf", "Cs", "Co", "Zl", "Zp"}


def single_line(text: str) -> str:
    r"""Return a text without control, format and direction characters, each replaced by a space.

    Parameters
    ----------
    text
        Any text.

    Returns
    -------
    str
        One line of visible characters.

    Examples
    --------
    >>> single_line("case 7\r\nP\u202e12\x00")
    'case 7  P 12 '
    """
    return "".join(" " if unicodedata.category(character) in _HIDDEN else character for character in text)


def ascii_line(text: str) -> str:
    r"""Return a text as one line of ASCII; other characters become backslash escapes.

    Parameters
    ----------
    text
        Any text.

    Returns
    -------
    str
        One line of printable ASCII.

    Examples
    --------
    >>> ascii_line("Größe")
    'Gr\\xf6\\xdfe'
    """
    return single_line(text).encode("ascii", "backslashreplace").decode("ascii")
