"""Section 7.2: cameras at the ceiling with lenses of 28 to 50 mm, by the normal equations of the planner."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.tables import Bar, Grid
from spinewatch.camera import Rig
from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.plan import Plan, PlanParameters, make_plan
from spinewatch.planning.planned_rig import planned_rig

HEIGHTS_MM = (2000.0, 2500.0, 3000.0)
LENSES_MM = (28.0, 35.0, 50.0)
CART_VERGENCE = 422.0 / 736.0
"""Baseline over height of the cart."""


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the planned accuracy of rigs at the ceiling beside that of the cart."""
    cart = _row("cart, 7.7 mm at 0.74 m", planned_rig())
    rows, planned = [cart], {}
    for height in HEIGHTS_MM:
        for lens in LENSES_MM:
            for name, baseline in (("the cart's", 422.0), ("scaled", CART_VERGENCE * height)):
                rig = planned_rig(baseline, height, lens)
                planned[height, lens, name] = _plan(rig)
                rows.append(_row(f"{lens:g} mm at {height / 1000:g} m, {name} baseline", rig))
    grid = Grid.of(
        "Section 7.2: rigs at the ceiling, sensor of the cart, balls to 0.1 px; deviations of a triad in the middle",
        [
            "rig",
            "baseline mm",
            "field mm",
            "px mm",
            "ball px",
            "sd X Y Z mm",
            "sd tilt deg",
            "all triads in view",
        ],
        rows,
    )
    own, cart_tilt = _depth_sd(_plan(planned_rig())), _tilt_sd(_plan(planned_rig()))
    best = min(_depth_sd(plan) for plan in planned.values())
    scaled = [plan for (*_, name), plan in planned.items() if name == "scaled"]
    tilts = [_tilt_sd(plan) for plan in scaled]
    wide = _field_mm(planned_rig(422.0, 3000.0, 28.0)), _field_mm(planned_rig())
    return [grid], [
        Bar(
            "a lens of 28 mm has the cart's field only at 3 m",
            f"{wide[0]:.0f} mm, cart {wide[1]:.0f} mm; {_field_mm(planned_rig(422.0, 2000.0, 28.0)):.0f} mm at 2 m",
            wide[0] >= wide[1] > _field_mm(planned_rig(422.0, 2500.0, 28.0)),
        ),
        Bar(
            "no ceiling rig reaches the cart's depth: a direction's error grows with the distance",
            f"best {best:.2f} mm, cart {own:.2f} mm",
            best > own,
        ),
        Bar(
            "with the cart's vergence (baselines of 1.1 to 1.7 m) tilts are about as good",
            f"{min(tilts):.2f} to {max(tilts):.2f} degrees, cart {cart_tilt:.2f}",
            max(tilts) < 1.2 * cart_tilt,
        ),
    ]


def _plan(rig: Rig) -> Plan:
    return make_plan(rig, FLAT_10_14_18, PlanParameters(heights_mm=(0.0,)))


def _depth_sd(plan: Plan) -> float:
    """Return the standard deviation of a triad's Z in the middle of the field, mm."""
    return float(plan.depths[0].position_sd_mm[2])


def _tilt_sd(plan: Plan) -> float:
    """Return the larger standard deviation of a triad's tilt in the middle of the field, degrees."""
    return float(np.max(plan.depths[0].rotation_sd_deg[:2]))


def _field_mm(rig: Rig) -> float:
    """Return the width of the field where the optical axes meet, mm."""
    return _plan(rig).pixel_mm * rig.left.image_size_px[0]


def _row(name: str, rig: Rig) -> tuple[str, ...]:
    plan = _plan(rig)
    depth = plan.depths[0]
    ball = FLAT_10_14_18.ball_diameter_mm / plan.pixel_mm
    return (
        name,
        f"{rig.baseline_mm:.0f}",
        f"{_field_mm(rig):.0f}",
        f"{plan.pixel_mm:.2f}",
        f"{ball:.1f}",
        " ".join(f"{x:.3f}" for x in depth.position_sd_mm),
        f"{_tilt_sd(plan):.2f}",
        "yes" if all(triad.in_view for triad in plan.accuracy.triads) else "no",
    )
