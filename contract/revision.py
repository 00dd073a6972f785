"""Revisions of stages: a take that was measured is measured again, or its labels and triads are edited."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from contract.base import Schema, Timestamp
from contract.surgery import VertebraName

MAX_EDITS = 60
TriadIndex = Annotated[
    int, Field(ge=0, le=1000, description="Place of the triad in `triads` of the revised take, from 0.")
]


class LabelEdit(Schema):
    """The label of a triad, decided by a person; the label that it has is thereby confirmed."""

    triad: TriadIndex
    label: Annotated[
        VertebraName | None, Field(description="The vertebra; null takes the label away.", examples=["T11"])
    ]


class TriadEdits(Schema):
    """Edits of the triads of a take; everything else of its result stays as it was measured."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"kind": "edit", "take": 1, "labels": [{"triad": 2, "label": "T9"}], "removed": [4]}]
        }
    )

    kind: Annotated[Literal["edit"], Field(description="Edits of labels and triads.")]
    take: Annotated[int, Field(ge=1, description="The take that is revised: the one whose results count.")]
    labels: list[LabelEdit] = Field(
        default_factory=list, max_length=MAX_EDITS, description="Labels that are confirmed or changed."
    )
    removed: list[TriadIndex] = Field(
        default_factory=list, max_length=MAX_EDITS, description="Triads that are none, and are left out."
    )

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        named = [edit.triad for edit in self.labels] + list(self.removed)
        if not named:
            raise ValueError("nothing is edited; name a label or a triad to remove")
        if len(set(named)) < len(named):
            raise ValueError("a triad is named twice; label it or remove it, once")
        return self


class Remeasurement(Schema):
    """The images of a take measured again, with other parameters or another template set."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"kind": "measure", "take": 1, "parameters": {"detection": {"min_score": 0.15}}},
                {"kind": "measure", "take": 2, "templates": "1995.1"},
            ]
        }
    )

    kind: Annotated[Literal["measure"], Field(description="Another measurement of the same images.")]
    take: Annotated[int, Field(ge=1, description="The take that is revised: the one whose results count.")]
    parameters: dict[str, Any] = Field(
        default_factory=dict,
        description="Parameters that differ from the workers' own, nested as in `parameters` of the result.",
    )
    templates: Annotated[
        str | None,
        Field(max_length=64, description="Version of the template set; null for the workers' own."),
    ] = None


NewRevision = Annotated[TriadEdits | Remeasurement, Field(discriminator="kind")]


class Revision(Schema):
    """Of which take another one is a revision, what was asked for, and by whom."""

    of_take: Annotated[int, Field(description="The take that was revised.")]
    changes: Annotated[NewRevision, Field(description="What was asked for.")]
    by: Annotated[
        str, Field(description="Who asked: prefix and name of the API key, or address of the client.")
    ]
    at: Timestamp
