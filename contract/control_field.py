"""Control fields that are designed, and which of their points a rig shows."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema, Vector3
from spinewatch.calibration.control_field import ControlField


class ControlPoint(Schema):
    """A point of a control field."""

    id: Annotated[str, Field(description="Its identifier, as in the CSV of a calibration.")]
    position_mm: Annotated[Vector3, Field(description="Its position on the board, mm.")]


class ControlFieldPlan(Schema):
    """A control field that is to be built; its points are those of the form of a calibration."""

    name: Annotated[str, Field(description="Name of the control field.")]
    points: Annotated[list[ControlPoint], Field(description="Its points, by row.")]
    csv: Annotated[
        str, Field(description="The points as the CSV that a calibration takes: id,x_mm,y_mm,z_mm.")
    ]
    visible: Annotated[
        list[str],
        Field(
            description="Identifiers of the points that both images show when the middle of the field is where the"
            " optical axes meet."
        ),
    ]

    @classmethod
    def of(cls, field: ControlField, csv: str, visible: tuple[str, ...]) -> ControlFieldPlan:
        """Return the contract model of a control field."""
        points = [
            ControlPoint(id=id_, position_mm=position)
            for id_, position in zip(field.ids, field.points_mm, strict=True)
        ]
        return cls(name=field.name, points=points, csv=csv, visible=list(visible))
