"""Revisions of stages: a take is measured again, or its labels, triads and ball centres are edited."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from contract.base import Schema, Timestamp, Vector2, Vector3
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


Side = Literal["left", "right"]
PairNumber = Annotated[
    int, Field(ge=1, le=60, description="Number of the pair; 1 unless the stage is a burst.")
]
FeaturePlace = Annotated[
    int,
    Field(ge=0, le=1000, description="Place in `features` of the revised take and this pair, from 0."),
]
Horizontal = Annotated[
    float, Field(ge=-1e5, le=1e5, description="u to the right, px; 0 is the centre of the first pixel.")
]
Vertical = Annotated[float, Field(ge=-1e5, le=1e5, description="v downwards, px.")]


class AddedCentre(Schema):
    """A ball centre that was not found, placed by a person."""

    action: Annotated[Literal["add"], Field(description="A new centre.")]
    pair: PairNumber = 1
    side: Annotated[Side, Field(description="The image.")]
    x: Horizontal
    y: Vertical


class MovedCentre(Schema):
    """A ball centre placed elsewhere by a person."""

    action: Annotated[Literal["move"], Field(description="Another place for a feature.")]
    pair: PairNumber = 1
    side: Annotated[Side, Field(description="The image.")]
    feature: FeaturePlace
    x: Horizontal
    y: Vertical


class RemovedCentre(Schema):
    """A feature that is no ball."""

    action: Annotated[Literal["remove"], Field(description="The feature is no ball.")]
    pair: PairNumber = 1
    side: Annotated[Side, Field(description="The image.")]
    feature: FeaturePlace


CentreEdit = Annotated[AddedCentre | MovedCentre | RemovedCentre, Field(discriminator="action")]


class RemovedTriad(Schema):
    """A triad that a person removed: it is not found again, unless a person has placed one of its centres since."""

    position_mm: Annotated[
        Vector3 | None, Field(description="Where it was, mm; null when that is not known.")
    ]
    left: Annotated[list[Vector2], Field(description="Its ball centres in the left image (u, v), px.")]
    right: Annotated[list[Vector2], Field(description="Its ball centres in the right image (u, v), px.")]


class TriadEdits(Schema):
    """Edits of a take: of labels and triads, and of the ball centres from which it is then matched again."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"kind": "edit", "take": 1, "labels": [{"triad": 2, "label": "T9"}], "removed": [4]},
                {
                    "kind": "edit",
                    "take": 2,
                    "centres": [
                        {"action": "move", "side": "left", "feature": 3, "x": 211.4, "y": 187.9},
                        {"action": "add", "side": "right", "x": 198.2, "y": 190.3},
                        {"action": "remove", "side": "right", "feature": 12},
                    ],
                },
            ]
        }
    )

    kind: Annotated[Literal["edit"], Field(description="Edits of labels, triads and ball centres.")]
    take: Annotated[int, Field(ge=1, description="The take that is revised: the one whose results count.")]
    labels: list[LabelEdit] = Field(
        default_factory=list, max_length=MAX_EDITS, description="Labels that are confirmed or changed."
    )
    removed: list[TriadIndex] = Field(
        default_factory=list, max_length=MAX_EDITS, description="Triads that are none, and are left out."
    )
    centres: list[CentreEdit] = Field(
        default_factory=list,
        max_length=MAX_EDITS,
        description="Ball centres that are added, moved or removed; the pair is then matched again.",
    )

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        named = [edit.triad for edit in self.labels] + list(self.removed)
        if not named and not self.centres:
            raise ValueError("nothing is edited; name a label, a triad to remove or a ball centre")
        if len(set(named)) < len(named):
            raise ValueError("a triad is named twice; label it or remove it, once")
        features = [
            (edit.pair, edit.side, edit.feature) for edit in self.centres if not isinstance(edit, AddedCentre)
        ]
        if len(set(features)) < len(features):
            raise ValueError("a feature is named twice; move it or remove it, once")
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


class Relabelling(Schema):
    """The labels of a take found again, because the stage that decided on them was revised.

    A worker asks for it of each later stage whose labels an earlier take had decided on. Labels that a person gave
    stay.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [{"kind": "relabel", "take": 1}]})

    kind: Annotated[Literal["relabel"], Field(description="Labels are found again.")]
    take: Annotated[int, Field(ge=1, description="The take that is revised: the one whose results count.")]


NewRevision = Annotated[TriadEdits | Remeasurement | Relabelling, Field(discriminator="kind")]


class Revision(Schema):
    """Of which take another one is a revision, what was asked for, and by whom."""

    of_take: Annotated[int, Field(description="The take that was revised.")]
    changes: Annotated[NewRevision, Field(description="What was asked for.")]
    by: Annotated[
        str, Field(description="Who asked: prefix and name of the API key, or address of the client.")
    ]
    at: Timestamp
