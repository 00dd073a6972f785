"""What is known of the pair of a stage beside its surgery, and how it is to be measured."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from contract.base import Schema
from spinewatch.errors import ParameterError
from spinewatch.markers import TriadModel, parse_marker
from spinewatch.numbers import parse_number

MAX_MARKERS = 8


_MAX_RANGE_MM = 1e5


def parse_range(text: str) -> tuple[float, float]:
    """Return the nearest and the farthest range of ``630,760``, mm; raise ``ValueError`` unless one is nearer."""
    near, far = (parse_number(number) for number in text.split(","))
    if not 0 < near < far <= _MAX_RANGE_MM:
        raise ValueError("must be the nearest and the farthest range, mm, such as 630,760")
    return near, far


def _range(text: str) -> str:
    parse_range(text)
    return text


def _marker(text: str) -> str:
    try:
        parse_marker(text)
    except ParameterError as error:
        raise ValueError(str(error)) from error
    return text


RangeText = Annotated[
    str,
    Field(
        pattern=r"^[0-9]{1,5}(\.[0-9]{1,6})?,[0-9]{1,5}(\.[0-9]{1,6})?$",
        description="Nearest and farthest range of the markers along the optical axes, mm.",
        examples=["630,760"],
    ),
    AfterValidator(_range),
]
MarkerText = Annotated[
    str,
    Field(
        min_length=1,
        max_length=64,
        description="A marker: its name, or flat:XX,YY,MX or orthogonal:XX,YY,ZZ with the lengths of its legs from P to"
        " the centres of the balls, mm. The order matters: flat:18,14,10 is flat-10-14-18, whose name begins with the"
        " shortest leg.",
        examples=["flat:18,14,10"],
    ),
    AfterValidator(_marker),
]


class Measuring(Schema):
    """What is known of a pair, and how it is measured; what is null or empty is the workers' own choice."""

    range_mm: Annotated[
        RangeText | None, Field(description="Nearest and farthest range along the optical axes, mm.")
    ] = None
    markers: Annotated[
        list[MarkerText], Field(max_length=MAX_MARKERS, description="Markers in use, one per kind.")
    ] = Field(default_factory=list)
    refine: Annotated[
        bool | None,
        Field(description="Whether candidates with unlike surroundings are discarded (thesis eq. 5.11)."),
    ] = None
    templates: Annotated[
        str | None, Field(max_length=64, description="Version of the template set of the workers.")
    ] = None

    @property
    def models(self) -> tuple[TriadModel, ...]:
        """The markers; none when they are not stated."""
        return tuple(parse_marker(text) for text in self.markers)

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the method that differ from the workers' own, nested as in a result."""
        matching: dict[str, Any] = {}
        if self.range_mm is not None:
            matching["epipolar"] = {"range_mm": list(parse_range(self.range_mm))}
        if self.refine is not None:
            matching["refinement"] = {"enabled": self.refine}
        return {"search": {"matching": matching}} if matching else {}
