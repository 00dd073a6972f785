"""Definitions of the measures, as the API lists them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema
from spinewatch.spine.definitions import DEFINITIONS


class MeasureDefinition(Schema):
    """What a measure is."""

    id: Annotated[
        str, Field(description="Stable identifier, stored with every value.", examples=["cobb-fixed"])
    ]
    name: Annotated[str, Field(description="Name for people.")]
    unit: Annotated[str, Field(description="Unit of the values: deg or mm.", examples=["deg"])]
    formula: Annotated[str, Field(description="Formula in the symbols of docs/measures.md.")]
    sign: Annotated[str, Field(description="What a positive value means.")]
    reference: Annotated[str, Field(description="Where the definition comes from, and where it departs.")]


class MeasureDefinitions(Schema):
    """Every definition."""

    items: Annotated[list[MeasureDefinition], Field(description="In the order of docs/measures.md.")]


def measure_definitions() -> MeasureDefinitions:
    """Return the definitions of this version."""
    return MeasureDefinitions(items=[MeasureDefinition.model_validate(d) for d in DEFINITIONS.values()])
