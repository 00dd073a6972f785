"""docs/measures.md from the registry of measures: ``python -m checks.measures_page`` compares, ``--write`` writes."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path

from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import MeasureStatus

PAGE = Path(__file__).parents[1] / "docs" / "measures.md"

_HEAD = """\
# Measures of the spine

Every value carries the identifier of its definition, its standard deviation, its 95% interval and its status. This
page is generated from `spinewatch/spine/definitions.py` by `python -m checks.measures_page --write`.

## Symbols

Patient axes (Stokes 1994): X anterior, Y left, Z cephalad, as of the baseline stage and fixed to the reference
vertebra. R is the rotation of a vertebra, with columns x anterior, y left, z cephalad; c the centroid of its body;
phi its coronal and theta its sagittal tilt, omega its axial rotation. Upper and lower are the end vertebrae of a
curve.

## Definitions
"""

_CURVES = """\
## Curves

Curves are those of the baseline stage, between its most cranial and its most caudal marker. End vertebrae are the
extremes of phi. Between all turning points of phi, the smallest swing is removed until each swing left is a curve:
at least {min_cobb_deg:g} degrees (SRS) and {min_cobb_deviations:g} of its standard deviations.
The largest swing is reported even when it is smaller. The apex is the vertebra farthest to the convex side from the
line between the end vertebrae. A sharp curve may lie between two neighbours: it has a Cobb angle, but none of the
measures of an apex. The side is not known where the 95% interval of the Cobb angle holds zero; the apex is then the
vertebra farthest to either side. Tilts and displacements are first smoothed as far as their errors require: least
squares with their third differences as observations of zero with a deviation of {tilt_roughness_deg:g} degrees and
{offset_roughness_mm:g} mm. A step between two neighbours that exceeds 4 deviations of such noise and roughness is kept.
Without errors nothing is smoothed. An end vertebra at the end of the span is an open end: the curve may go on beyond.

The end vertebrae of the re-selected Cobb angle are the extremes of the smoothed tilts at each stage, after
{reselection_deviations:g} of its deviation has been taken from each; the angle is the difference of their measured
tilts. It is convex to the side that the curve is convex to at that stage between its end vertebrae of the baseline, so
that a curve that went past zero changes its sign. Where that side is not known and the other one has other end
vertebrae, the angle between those brackets it. An interpolated vertebra that may be tilted more brackets the angle. The
deviation includes what is expected to be lost where others are tilted more. If several neighbours are tilted nearly
alike, the angle between the end vertebrae is exaggerated by up to half its deviation.

## Status
"""

_STATUSES = {
    MeasureStatus.MEASURED: "every vertebra that the measure needs has a marker at this stage, or is known from the"
    " initial configuration at the baseline, unless that is a generic spine",
    MeasureStatus.BRACKETED: "at least one of them is interpolated, or one of a generic spine without a marker: the"
    " interval contains the values by other interpolations (slerp and spline of the absolute orientation, slerp of the"
    " change), widened by the deviation. A re-selected Cobb angle also if other vertebrae may be its ends",
    MeasureStatus.NOT_MEASURED: "there is a reason instead of a value. What the reference vertebra has by definition is"
    " not measured either: its displacement, and where it is an apex its rotation after the baseline and changes",
}

_TAIL = """\
A value is `assumed` when the initial configuration is a generic spine.

## Standard deviations and intervals

Errors of poses are kept by independent source, so that a change between two stages has only the errors that the
stages do not share. Deviations are of first order; for the distraction of a displacement, a product of two small
errors, they are corrected (Goodman 1960). The interval is the value plus and minus 1.96 deviations, except for:

- the angle of a rotation, which is never negative: the lengths in the ellipsoid of 1.96 deviations about the rotation
  vector, less what errors across it add on average, and zero unless the vector differs from zero (95%, three errors).
  It covers 93 to 99%;
- the 3-D angle, the length of a vector, which is never negative: the lengths in the ellipse of 1.96 deviations about
  the vector, and zero unless the vector differs from zero (95%, both errors). It covers 91 to 98%;
- the plane of maximum curvature, the direction of a vector d (Fieller's theorem): the directions with a unit vector n
  across them for which (n.d)^2 <= 1.96^2 n^T S n, with the covariance S of d. It is asymmetric where the errors differ
  by direction.

Sagittal and coronal tilts have different errors, so both take the full covariance. The plane is not measured unless
sqrt(d^T S^-1 d) is at least {min_deviations:.2f}: as many deviations as a direction with a deviation of
{max_azimuth_sd_deg:g} degrees has if its errors are alike in all directions. Otherwise the end vertebrae are nearly
parallel. Of straight spines 2% have a plane all the same. Where the true d is less than 4 deviations long, the interval
of a plane that is reported holds the truth less often than 95%: 92% at 3 deviations, 87% at 2.

## Attribution

**Cobb angle of a curve.** The horizontal part of z_upper - z_lower has a length (the size of the curve) and an
azimuth (its plane of maximum curvature). Together with the common tilt of both end vertebrae, in the axes of that
plane, they determine the Cobb angle: about size x sin(azimuth). Its change is divided among the three causes by the
Shapley value, the effect of each averaged over all orders of the causes:

- `rotation`: change of the azimuth. A curve that turns rigidly about Z changes by rotation only;
- `distraction`: change of the size, which is straightening or distraction;
- `remainder`: change of the common tilt. It is small.

The three add up to the change, and each has its deviation and interval. When the plane is not determined at one of
the stages, or its own deviation is above {max_azimuth_sd_deg:g} degrees, only the total is given: the deviations of the
parts are of first order.

**Lateral displacement of a vertebra**, and the apical translation of a curve as that of its apex. The way from the
reference vertebra goes along the vertebrae that are marked at both stages. For a segment of length l and direction
u, l2 u2 - l1 u1 = (l2 - l1)(u1 + u2)/2 + (l1 + l2)/2 (u2 - u1) exactly:

- `distraction`: change of lengths at the mean direction;
- `rotation`: change of directions at the mean length.

Where the spine turns as a whole against the reference vertebra, that is rotation too. Numbers say what came
together with rotation and distraction, not which force caused it. The parts are measured between the vertebrae of
their quantity, and are bracketed or assumed as its change is.
"""


def page() -> str:
    """Return the text of docs/measures.md."""
    rows = [
        f"| `{definition.id}` | {definition.name} | {definition.unit} | {definition.formula} | {definition.sign} |"
        f" {definition.reference} |"
        for definition in DEFINITIONS.values()
    ]
    parameters = MeasureParameters()
    least = 1 / math.radians(parameters.max_azimuth_sd_deg)
    curves, tail = (text.format(**vars(parameters), min_deviations=least) for text in (_CURVES, _TAIL))
    pairs = [
        f"{name.capitalize()} is reported for {', '.join('-'.join(pair) for pair in getattr(parameters, name))}:"
        " the first pair always, the others where the spine has their levels."
        for name in ("kyphosis", "lordosis")
    ]
    statuses = [f"| `{status}` | {meaning} |" for status, meaning in _STATUSES.items()]
    table = ["| id | name | unit | formula | positive | reference |", "|---|---|---|---|---|---|", *rows]
    status_table = ["| status | meaning |", "|---|---|", *statuses]
    return "\n".join([_HEAD, *table, "", *pairs, "", curves, *status_table, "", tail])


def main(arguments: Sequence[str]) -> int:
    """Write the page, or return 1 when the committed one differs from the registry."""
    if "--write" in arguments:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    if PAGE.read_text(encoding="utf-8") == page():
        return 0
    sys.stderr.write(
        "docs/measures.md differs from spinewatch/spine/definitions.py; run: python -m checks.measures_page --write\n"
    )
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
