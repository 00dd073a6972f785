"""Measures of a spine, their changes and their attribution: result types; NumPy only."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from spinewatch.arrays import Float
from spinewatch.spine.configuration import Origin


class MeasureStatus(StrEnum):
    """How far a measure is determined."""

    MEASURED = "measured"
    BRACKETED = "bracketed"
    NOT_MEASURED = "not_measured"


@dataclass(frozen=True)
class Curve:
    """A curve of the spine in the coronal plane, as the first stage shows it.

    Attributes
    ----------
    name
        Its name, ``curve 1`` for the most cranial.
    upper, lower
        Names of the end vertebrae.
    apex
        Name of the vertebra between them that is farthest from the line between them; None if none lies between: the
        apex is their disc.
    side
        Side of the convexity, ``right`` or ``left``; None if the errors leave it open.
    open_ends
        End vertebrae that are the end of the measured span: the curve may go on beyond.
    """

    name: str
    upper: str
    apex: str | None
    lower: str
    side: str | None
    open_ends: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasureValue:
    """A measure of one stage, or its change between two.

    Attributes
    ----------
    definition
        Identifier of its definition in `spine.definitions.DEFINITIONS`.
    curve
        Name of the curve that it belongs to; None for a measure of the whole spine.
    levels
        Vertebrae that it is measured between, from cranial to caudal.
    value
        The value, in the unit of the definition; NaN when not measured.
    sd
        Its standard deviation.
    lower, upper
        Ends of its 95% interval; for a bracketed value they contain the interpolations too.
    status
        How far it is determined.
    assumed
        Whether it depends on an assumed initial configuration.
    reason
        Why it is bracketed or not measured; None for a measured one.
    """

    definition: str
    curve: str | None
    levels: tuple[str, ...]
    value: float
    sd: float
    lower: float
    upper: float
    status: MeasureStatus
    assumed: bool
    reason: str | None


@dataclass(frozen=True, eq=False)
class VertebraChange:
    """Motion of one vertebra between two stages, patient axes.

    Attributes
    ----------
    vertebra
        Its name.
    origin
        The later precedence of its origins at both stages.
    reason
        Why there is no motion; None if there is one.
    translation_mm, translation_sd_mm
        Displacement of the centroid (anterior, left, cephalad) and its deviations, shape (3,), mm.
    rotation
        Rotation, shape (3, 3), patient axes.
    rotation_vector_deg, rotation_sd_deg
        The same as axis times angle, about the patient's x, y and z, and its deviations, shape (3,), degrees.
    angle_deg, angle_sd_deg
        Angle of the rotation and its deviation, to first order, degrees.
    angle_lower_deg, angle_upper_deg
        Ends of its 95% interval, never negative, degrees.
    derotation_deg, derotation_sd_deg
        Rotation about the vertebra's own z (twist of the swing-twist decomposition), degrees; positive turns the
        anterior side to the left.
    coronal_deg, coronal_sd_deg, sagittal_deg, sagittal_sd_deg
        Changes of the coronal and of the sagittal tilt, degrees.
    distraction_mm, distraction_sd_mm
        Change of the length of the curve from the reference vertebra, mm; positive is longer.
    """

    vertebra: str
    origin: Origin
    reason: str | None
    translation_mm: Float
    translation_sd_mm: Float
    rotation: Float
    rotation_vector_deg: Float
    rotation_sd_deg: Float
    angle_deg: float
    angle_sd_deg: float
    angle_lower_deg: float
    angle_upper_deg: float
    derotation_deg: float
    derotation_sd_deg: float
    coronal_deg: float
    coronal_sd_deg: float
    sagittal_deg: float
    sagittal_sd_deg: float
    distraction_mm: float
    distraction_sd_mm: float


@dataclass(frozen=True)
class Share:
    """A part of a change; NaN when not measured.

    Attributes
    ----------
    value
        The part, in the unit of the quantity.
    sd
        Its standard deviation.
    lower, upper
        Ends of its 95% interval.
    """

    value: float
    sd: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Attribution:
    """How much of a correction came with rotation and how much with distraction.

    Attributes
    ----------
    subject
        Name of a curve, or of a vertebra.
    quantity
        Identifier of the definition of what is attributed: the Cobb angle of a curve (degrees), or the lateral
        displacement of a vertebra (mm).
    total
        The change.
    rotation, distraction
        The two parts.
    remainder
        What the two parts leave of the total; exactly zero for a displacement.
    reason
        Why the change is bracketed, or why it or its parts are not measured; None for measured ones.
    levels
        Vertebrae that the quantity is measured between, from cranial to caudal.
    status
        How far the change is determined, and the parts that have a value.
    assumed
        Whether it depends on an assumed initial configuration.
    """

    subject: str
    quantity: str
    total: Share
    rotation: Share
    distraction: Share
    remainder: Share
    reason: str | None
    levels: tuple[str, ...]
    status: MeasureStatus
    assumed: bool


@dataclass(frozen=True)
class MeasuredSpine:
    """Curves and measures of one configuration.

    Attributes
    ----------
    curves
        Curves of the baseline, cranial first.
    measures
        Measures of the stage.
    """

    curves: tuple[Curve, ...]
    measures: tuple[MeasureValue, ...]


@dataclass(frozen=True)
class SpineChange:
    """What happened between two stages.

    Attributes
    ----------
    vertebrae
        Motion of each vertebra.
    measures
        Changes of the measures whose levels do not change: value of the later stage less that of the earlier one.
    attribution
        Attribution per curve and per vertebra.
    """

    vertebrae: tuple[VertebraChange, ...]
    measures: tuple[MeasureValue, ...]
    attribution: tuple[Attribution, ...]
