"""Text options of a calibration form: the grammar and the parser of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, THESIS_NAMES
from spinewatch.numbers import parse_number

INTERIOR = THESIS_NAMES[len(EXTERIOR_NAMES) :]
"""Interior parameters that may be adjusted or fixed."""

_NAME = f"({'|'.join(INTERIOR)})"
_NUMBER = r"[+-]?[0-9]{1,9}(\.[0-9]{1,15})?([eE][+-]?[0-9]{1,2})?"


def parse_pixel_size(text: str) -> tuple[float, float]:
    """Return width and height of ``0.01,0.00845``, mm; raises ``ValueError`` unless both are positive."""
    width, height = (parse_number(number) for number in text.split(","))
    if not (width > 0 and height > 0):
        raise ValueError("must be two positive numbers")
    return width, height


def parse_free(text: str) -> list[str]:
    """Return the names of ``f,x0,y0,K1``; raises ``ValueError`` if one is repeated."""
    names = text.split(",")
    _require_distinct(names)
    return names


def parse_fix(text: str) -> dict[str, float]:
    """Return the values by name of ``x0=0,y0=0``; raises ``ValueError`` if a name is repeated."""
    pairs = [item.split("=") for item in text.split(",")]
    _require_distinct([name for name, _ in pairs])
    return {name: parse_number(value) for name, value in pairs}


def _require_distinct(names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        raise ValueError("names a parameter twice; name each once")


def _parsed_by(parse: Callable[[str], Any]) -> AfterValidator:
    """Return a validator that rejects what ``parse`` rejects; FastAPI requires a form field to remain text."""

    def validate(text: str) -> str:
        parse(text)
        return text

    return AfterValidator(validate)


PixelSizeText = Annotated[
    str, Field(pattern=f"^{_NUMBER},{_NUMBER}$", examples=["0.01,0.00845"]), _parsed_by(parse_pixel_size)
]
FreeText = Annotated[
    str, Field(pattern=f"^{_NAME}(,{_NAME})*$", examples=["f,x0,y0,K1"]), _parsed_by(parse_free)
]
FixText = Annotated[
    str,
    Field(pattern=f"^{_NAME}={_NUMBER}(,{_NAME}={_NUMBER})*$", examples=["x0=0,y0=0"]),
    _parsed_by(parse_fix),
]
