"""Definitions of the measures: the registry that docs/measures.md is generated from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class MeasureDefinition:
    """What a measure is.

    Attributes
    ----------
    id
        Stable identifier; stored with every value and carried by every export.
    name
        Name for people.
    unit
        ``deg`` or ``mm``.
    formula
        Formula in the symbols of docs/measures.md.
    sign
        What a positive value means.
    reference
        Where the definition comes from, and where it departs from it.
    """

    id: str
    name: str
    unit: str
    formula: str
    sign: str
    reference: str


_STOKES = "Stokes 1994, Spine 19:236 (SRS working group on 3-D terminology)"

_DEFINITIONS: tuple[MeasureDefinition, ...] = (
    MeasureDefinition(
        id="cobb-fixed",
        name="Cobb angle, end vertebrae of the baseline",
        unit="deg",
        formula="phi_lower - phi_upper",
        sign="convex to the right",
        reference="Cobb 1948, in the coronal plane; the end vertebrae are those of the baseline stage at every stage,"
        " where a radiograph is usually measured at the most tilted ones",
    ),
    MeasureDefinition(
        id="cobb-reselected",
        name="Cobb angle, end vertebrae selected again",
        unit="deg",
        formula="phi_lower - phi_upper at the extremes of phi: upper above the own apex, up to the apex of the curve"
        " above; lower below it, down to the apex of the curve below (apices of the baseline)",
        sign="convex to the right",
        reference="Cobb 1948, in the coronal plane, at the most tilted vertebrae of each stage; these are selected in"
        " smoothed tilts, because the most tilted of several vertebrae with errors is tilted too much",
    ),
    MeasureDefinition(
        id="kyphosis",
        name="Kyphosis",
        unit="deg",
        formula="theta_a - theta_b, a cranial",
        sign="kyphosis",
        reference=f"sagittal Cobb angle, {_STOKES}; from tilts of vertebrae, where a radiograph shows the upper end"
        " plate of the one and the lower end plate of the other",
    ),
    MeasureDefinition(
        id="lordosis",
        name="Lordosis",
        unit="deg",
        formula="theta_b - theta_a, a cranial",
        sign="lordosis",
        reference=f"sagittal Cobb angle, {_STOKES}; the negative of the kyphosis between the same vertebrae",
    ),
    MeasureDefinition(
        id="apical-rotation",
        name="Apical axial rotation",
        unit="deg",
        formula="omega_apex = 2 atan2(q_z, q_w), q the quaternion of R_apex",
        sign="anterior side turns left",
        reference=f"{_STOKES}; twist of the swing-twist decomposition about the vertebra's own z, in patient axes",
    ),
    MeasureDefinition(
        id="apical-rotation-projected",
        name="Apical axial rotation, projected",
        unit="deg",
        formula="atan2(x_apex.Y, x_apex.X)",
        sign="anterior side turns left",
        reference=f"{_STOKES}; the anterior axis as the top view shows it, so that tilts enter",
    ),
    MeasureDefinition(
        id="apical-translation",
        name="Apical translation",
        unit="mm",
        formula="-(c_apex - L).Y, L the reference line",
        sign="right",
        reference=f"{_STOKES}; L is the line along the patient's Z through the centroid of the reference vertebra,"
        " because a prone patient has no plumb line",
    ),
    MeasureDefinition(
        id="coronal-balance",
        name="Coronal balance",
        unit="mm",
        formula="-(c_top - c_bottom).Y",
        sign="upper end to the right",
        reference=f"{_STOKES}; between the most cranial and the most caudal vertebra with a marker at the baseline, in"
        " patient axes and not against gravity",
    ),
    MeasureDefinition(
        id="angle-3d",
        name="3-D angle",
        unit="deg",
        formula="acos(z_upper . z_lower)",
        sign="never negative",
        reference=f"{_STOKES}; between the end vertebrae of the baseline, in the plane that contains both z",
    ),
    MeasureDefinition(
        id="plane-of-maximum-curvature",
        name="Plane of maximum curvature",
        unit="deg",
        formula="atan2(d.Y, d.X), d the horizontal part of z_upper - z_lower",
        sign="from kyphosis (0) to convex to the right (90); convex to the left is -90, lordosis 180",
        reference=f"{_STOKES}; directed, so that kyphosis and lordosis differ. Ends of the interval may pass 180",
    ),
    MeasureDefinition(
        id="ferguson",
        name="Ferguson angle",
        unit="deg",
        formula="phi(c_apex - c_lower) - phi(c_upper - c_apex), phi the coronal tilt of a line",
        sign="convex to the right",
        reference="Ferguson 1945, with centroids of the bodies; vertebrae of the baseline",
    ),
    MeasureDefinition(
        id="coronal-tilt",
        name="Coronal tilt",
        unit="deg",
        formula="phi = atan2(-z.Y, z.Z)",
        sign="left side up",
        reference=f"{_STOKES}; trace of the end plates in the coronal plane",
    ),
    MeasureDefinition(
        id="sagittal-tilt",
        name="Sagittal tilt",
        unit="deg",
        formula="theta = atan2(z.X, z.Z)",
        sign="leans forwards",
        reference=f"{_STOKES}; trace of the end plates in the sagittal plane",
    ),
    MeasureDefinition(
        id="axial-rotation",
        name="Axial rotation",
        unit="deg",
        formula="omega = 2 atan2(q_z, q_w), q the quaternion of R",
        sign="anterior side turns left",
        reference=f"{_STOKES}; twist of the swing-twist decomposition about the vertebra's own z",
    ),
    MeasureDefinition(
        id="lateral-displacement",
        name="Lateral displacement",
        unit="mm",
        formula="-(c - L).Y, L the reference line",
        sign="right",
        reference=f"{_STOKES}; from the same line as the apical translation",
    ),
)

DEFINITIONS: Mapping[str, MeasureDefinition] = {definition.id: definition for definition in _DEFINITIONS}
"""Every definition by its identifier."""
