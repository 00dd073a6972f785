"""Plane of maximum curvature and 3-D angle of small curves, where errors differ by direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from bench.spine_truth import CIRCULAR, difference
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.evaluation import MeasureRequest, evaluate
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import stage_value
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.uncertainty import common_factors

RATIOS = (1.0, 3.0, 10.0)
"""Deviations of the sagittal tilts by those of the coronal ones."""

SIZES = (0.0, 2.0, 4.0, 8.0)
"""Size of the true curve, in the deviations of its own direction."""

KNOWN_SIZE = 8.0
"""Size from which the plane is known, and its interval holds the truth as often as that of any measure."""

PLANES = {"sagittal": 0.0, "coronal": 90.0}
"""Azimuths of the true curve, degrees."""

CORONAL_SD_DEG = 0.5
"""Deviation of the coronal tilt of each of the two end vertebrae."""

_ENDS = ("T5", "T12")


@dataclass
class PlaneTally:
    """What is reported of curves of one size, plane and ratio of the errors.

    Attributes
    ----------
    ratio
        Deviation of sagittal by that of coronal tilts.
    plane
        Plane of the true curve.
    size
        Its size in its deviations.
    planes
        For each curve whether its interval holds the true plane; None where no plane is reported.
    angles
        For each curve whether the interval of the 3-D angle holds the true one, and the value too.
    """

    ratio: float
    plane: str
    size: float
    planes: list[bool | None] = field(default_factory=list)
    angles: list[bool] = field(default_factory=list)

    @property
    def reported_pct(self) -> float:
        """Percentage of the curves whose plane is reported."""
        return 100 * float(np.mean([inside is not None for inside in self.planes]))

    @property
    def inside_pct(self) -> float:
        """Percentage of the reported planes whose interval holds the truth."""
        reported = [inside for inside in self.planes if inside is not None]
        return 100 * float(np.mean(reported)) if reported else float("nan")

    @property
    def wrong_pct(self) -> float:
        """Percentage of all curves with a reported plane whose interval does not hold the truth; any, if straight."""
        return 100 * float(np.mean([inside is False for inside in self.planes]))

    @property
    def angle_pct(self) -> float:
        """Percentage of the intervals of the 3-D angle that hold the truth."""
        return 100 * float(np.mean(self.angles))


def planes(count: int) -> list[PlaneTally]:
    """Return what is reported of ``count`` curves of each size, plane and ratio of the errors."""
    rng = np.random.default_rng([12, 8])
    found = []
    for ratio, plane, size in product(RATIOS, PLANES, SIZES):
        tally = PlaneTally(ratio, plane, size)
        for _ in range(count):
            _count(tally, rng)
        found.append(tally)
    return found


def _count(tally: PlaneTally, rng: np.random.Generator) -> None:
    """Add a measured curve to a tally."""
    sd = CORONAL_SD_DEG * np.array([1.0, tally.ratio, 1.0])
    azimuth = PLANES[tally.plane]
    angle = tally.size * np.sqrt(2) * (sd[1] if tally.plane == "sagittal" else sd[0])
    # The axis about which z turns towards the azimuth.
    axis = np.array([-np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth)), 0.0])
    true = [rotation_from_vector(np.radians(half * angle / 2) * axis) for half in (1, -1)]
    rotation = np.stack([rotation_from_vector(np.radians(sd * rng.standard_normal(3))) @ R for R in true])
    spine = _spine(rotation, sd)
    (factor,) = common_factors((spine,))
    parameters = MeasureParameters()
    values = {}
    for definition in ("angle-3d", CIRCULAR):
        request = MeasureRequest(definition, "curve 1", _ENDS)
        found = evaluate(request, spine, factor, frozenset())
        values[definition] = stage_value(request, found, assumed=False, parameters=parameters)
    value, plane = values["angle-3d"], values[CIRCULAR]
    tally.angles.append(value.lower <= angle <= value.upper and value.lower <= value.value <= value.upper)
    if plane.status is MeasureStatus.NOT_MEASURED:
        tally.planes.append(None)
        return
    middle = (plane.lower + plane.upper) / 2
    apart = abs(difference(CIRCULAR, azimuth, middle))
    tally.planes.append(tally.size > 0 and apart <= (plane.upper - plane.lower) / 2)


def _spine(rotation: Float, sd_deg: Float) -> SpineConfiguration:
    """Return two vertebrae with independent errors of their rotations (3,) in patient axes."""
    errors = np.zeros((2, 6, 6))
    errors[0, 3:, :3] = errors[1, 3:, 3:] = np.diag(sd_deg)
    poses = SpinePoses(np.array([[0.0, 0, 200], [0, 0, 0]]), rotation)
    marked, origins = (True, True), (Origin.MEASURED, Origin.MEASURED)
    return SpineConfiguration(_ENDS, marked, origins, (None, None), poses, {"triads": errors})


def grids_and_bars(found: list[PlaneTally]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of planes and 3-D angles and their bars."""
    rows = [
        (
            f"{tally.ratio:g}",
            tally.plane,
            f"{tally.size:g}",
            len(tally.planes),
            f"{tally.reported_pct:.1f}",
            f"{tally.inside_pct:.1f}",
            f"{tally.wrong_pct:.1f}",
            f"{tally.angle_pct:.1f}",
        )
        for tally in found
    ]
    columns = [
        "sagittal / coronal sd",
        "plane",
        "size, sd",
        "n",
        "plane reported, %",
        "of these inside, %",
        "wrong, % of all",
        "3-D angle inside, %",
    ]
    title = "Plane of maximum curvature given that it is reported, and 3-D angle, of small curves"
    return [Grid.of(title, columns, rows)], tuple(_bars(found))


def _bars(found: list[PlaneTally]) -> Iterator[Bar]:
    known = [tally.inside_pct for tally in found if tally.size >= KNOWN_SIZE]
    wrong = [tally.wrong_pct for tally in found]
    angles = [tally.angle_pct for tally in found]
    yield Bar(
        f"95% intervals of reported planes hold 93-97%, curves of {KNOWN_SIZE:g} deviations",
        f"{min(known):.1f} to {max(known):.1f}%",
        min(known) >= 93 and max(known) <= 97,
    )
    yield Bar(
        "a plane that is reported and wrong: at most 7% of all curves, of every size",
        f"up to {max(wrong):.1f}%",
        max(wrong) <= 7,
    )
    yield Bar(
        "95% intervals of the 3-D angle hold the value and 90-98%, small curves",
        f"{min(angles):.1f} to {max(angles):.1f}%",
        min(angles) >= 90 and max(angles) <= 98,
    )
