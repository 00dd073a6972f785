"""Triads and their motion as the thesis of 1995 gives them (Table 6.1, eq. 6.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from contract.base import Identifier, Number, Schema, StageName, Vector3, Vertebra
from contract.flag import Flag

if TYPE_CHECKING:
    import spinewatch.spine.legacy_1995


class TriadRow(Schema):
    """One row of Table 6.1."""

    vertebra: Annotated[Vertebra, Field(description="Label of the triad.")]
    position_mm: Annotated[
        Vector3, Field(description="P less that of the reference triad, object axes of the stage, mm.")
    ]
    position_sd_mm: Annotated[Vector3, Field(description="Its standard deviations, mm.")]
    angles_deg: Annotated[
        Vector3, Field(description="Angles of the normal with the object axes X, Y and Z, degrees.")
    ]
    tilt_sd_deg: Annotated[
        Number, Field(description="Bound for the standard deviation of each angle, degrees.")
    ]

    @classmethod
    def of(cls, row: spinewatch.spine.legacy_1995.TriadRow) -> TriadRow:
        """Return the contract model of the library's row."""
        return cls.model_validate(row)


class LegacyMotion(Schema):
    """Motion of one triad by eq. 6.1: the rotation about the normal is lost."""

    vertebra: Annotated[Vertebra, Field(description="Label of the triad.")]
    axis: Annotated[Vector3, Field(description="Axis of the rotation between the normals, object axes.")]
    angle_deg: Annotated[Number, Field(description="Its angle, at most 90 degrees.")]
    angle_sd_deg: Annotated[Number, Field(description="Bound for its standard deviation, degrees.")]
    displacement_mm: Annotated[Number, Field(description="Displacement of P relative to the reference, mm.")]
    displacement_sd_mm: Annotated[Number, Field(description="Its standard deviation to first order, mm.")]

    @classmethod
    def of(cls, motion: spinewatch.spine.legacy_1995.LegacyMotion) -> LegacyMotion:
        """Return the contract model of the library's motion."""
        return cls.model_validate(motion)


class LegacyTable(Schema):
    """The triads of one stage in the form of Table 6.1."""

    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    frame: Annotated[str, Field(description="Name of the coordinate system.")]
    rows: Annotated[list[TriadRow], Field(description="One row per triad.")]


class LegacyComparison(Schema):
    """Two stages compared by the method of 1995, for comparison with `Motion`."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    method: Annotated[str, Field(description="Name of the method: legacy_1995.")]
    reference_vertebra: Annotated[Vertebra, Field(description="Vertebra of the reference triad.")]
    before: Annotated[LegacyTable, Field(description="The earlier stage.")]
    after: Annotated[LegacyTable, Field(description="The later stage.")]
    motion: Annotated[list[LegacyMotion], Field(description="Motion of each triad that both stages have.")]
    flags: Annotated[list[Flag], Field(description="Motions that a spine does not make.")]
