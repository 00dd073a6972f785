"""Numbers that people type: in options, forms, tables and files of cameras."""

from __future__ import annotations

import math
import re

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_WORD = re.compile(r"[+-]?(?:inf|infinity|nan)", re.IGNORECASE)


class NumberTextError(ValueError):
    """A text is not a number; the message continues a sentence, such as "is not a number"."""


def parse_number(text: str) -> float:
    """Return a number that was typed.

    Python's `float` also takes `1_80` as 180 and digits of other scripts; a slip of the finger beside the decimal point
    multiplies by ten there.

    Parameters
    ----------
    text
        Decimal digits with or without a sign, a decimal point and an exponent. Spaces around it are ignored.

    Returns
    -------
    float
        The number.

    Raises
    ------
    NumberTextError
        If the text is anything else, or no finite number.

    Examples
    --------
    >>> parse_number(" -1.80e2")
    -180.0
    >>> parse_number("1_80")
    Traceback (most recent call last):
    spinewatch.numbers.NumberTextError: has an underscore and is not a number
    """
    word = text.strip()
    if _NUMBER.fullmatch(word):
        number = float(word)
        if math.isfinite(number):
            return number
        raise NumberTextError("is too large and not finite")
    if _WORD.fullmatch(word):
        raise NumberTextError("is not finite")
    if "_" in word:
        raise NumberTextError("has an underscore and is not a number")
    if any(character.isdigit() and not character.isascii() for character in word):
        raise NumberTextError("has digits other than 0 to 9 and is not a number")
    raise NumberTextError("is not a number")
