"""Regular expressions that a site sets, matched in a time that grows with the length of the text alone."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import StringConstraints, TypeAdapter, ValidationError
from pydantic_core import SchemaError


class LinearPattern:
    r"""A regular expression without look-around and back-references, which no text keeps busy.

    Pydantic matches it by the Rust library regex; the module ``re`` tries some patterns in a number of ways that
    doubles with each character.

    Parameters
    ----------
    pattern
        The regular expression.

    Raises
    ------
    ValueError
        If it is none, or needs what the library does not have.

    Examples
    --------
    >>> LinearPattern("(?:K[0-9]+)+").fullmatch("K17K4")
    True
    >>> LinearPattern(r"(\d)-\1")
    Traceback (most recent call last):
    ValueError: not a regular expression that can be used here (backreferences are not supported)
    """

    def __init__(self, pattern: str) -> None:
        self.pattern = pattern
        _adapter(pattern)  # what is no pattern by itself must not become one between the anchors
        self._whole = _adapter(rf"\A(?:{pattern})\z")

    def fullmatch(self, string: str, /) -> bool:
        """Return whether all of a text matches.

        Parameters
        ----------
        string
            The text.

        Returns
        -------
        bool
            Whether it matches.
        """
        try:
            self._whole.validate_python(string)
        except ValidationError:
            return False
        return True


TextPattern = re.Pattern[str] | LinearPattern
"""What a text must match as a whole."""


def _adapter(pattern: str) -> TypeAdapter[str]:
    try:
        return TypeAdapter(Annotated[str, StringConstraints(pattern=pattern)])
    except SchemaError as error:
        reason = str(error).rpartition("error: ")[2].strip()
        raise ValueError(f"not a regular expression that can be used here ({reason})") from error
