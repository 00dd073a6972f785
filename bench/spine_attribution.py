"""What the attribution makes of single manoeuvres that are known, without noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.spine_surgeries import BASELINE, INTER, CartMotion, simulated_surgery
from bench.tables import Bar, Grid
from spinewatch.simulation.scoliosis import CurveKind, Manoeuvre
from spinewatch.spine.attribution import attribute

MANOEUVRES = (
    ("rod rotation by 30 deg", Manoeuvre(rod_rotation_deg=30.0, twist_share=0.0, margin_levels=30.0)),
    ("straightening by 40%", Manoeuvre(straightening=0.4)),
    ("distraction by 15 mm", Manoeuvre(distraction_mm=15.0)),
    ("derotation by half", Manoeuvre(derotation=0.5)),
)
QUANTITIES = ("cobb-fixed", "lateral-displacement")


@dataclass(frozen=True)
class Parts:
    """Mean absolute change of a quantity by a manoeuvre, and of its parts, degrees or mm."""

    manoeuvre: str
    quantity: str
    total: float
    rotation: float
    distraction: float


def parts_of_manoeuvres(count: int) -> tuple[Parts, ...]:
    """Return the parts over ``count`` thoracic curves."""
    found = []
    for name, manoeuvre in MANOEUVRES:
        shares: dict[str, list[tuple[float, float, float]]] = {quantity: [] for quantity in QUANTITIES}
        for seed in range(count):
            surgery = simulated_surgery(
                np.random.default_rng([12, 11, seed]),
                CurveKind.THORACIC,
                manoeuvres=(manoeuvre,),
                cart=CartMotion(),
            )
            before, after = (surgery.true_configuration(stage) for stage in (BASELINE, INTER))
            for part in attribute(before, after, before, surgery.reference):
                if part.quantity in shares and part.reason is None:
                    shares[part.quantity].append(
                        (part.total.value, part.rotation.value, part.distraction.value)
                    )
        for quantity, values in shares.items():
            found.append(Parts(name, quantity, *(float(v) for v in np.abs(np.array(values)).mean(axis=0))))
    return tuple(found)


def grids_and_bars(found: Sequence[Parts]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of parts and its bars."""
    rows = (
        (p.manoeuvre, p.quantity, f"{p.total:.2f}", f"{p.rotation:.2f}", f"{p.distraction:.2f}")
        for p in found
    )
    columns = ["manoeuvre", "of", "change", "by rotation", "by distraction"]
    by_key = {(p.manoeuvre, p.quantity): p for p in found}
    rod, opened = by_key[MANOEUVRES[0][0], QUANTITIES[0]], by_key[MANOEUVRES[2][0], QUANTITIES[1]]
    checks = (
        Bar(
            "rod rotation changes the Cobb angle by rotation, > 3 times as much as by distraction",
            f"{rod.rotation:.1f} and {rod.distraction:.1f} deg",
            rod.rotation > 3 * rod.distraction,
        ),
        Bar(
            "distraction displaces vertebrae by distraction, > 3 times as much as by rotation",
            f"{opened.distraction:.2f} and {opened.rotation:.2f} mm",
            opened.distraction > 3 * opened.rotation,
        ),
    )
    title = "Attribution of known manoeuvres without noise, mean absolute values, deg and mm"
    return [Grid.of(title, columns, rows)], checks
