"""``python -m bench.large_balls``: centres of simulated balls of 20 px, as in images of more pixels than the cart's.

The rendered pairs have balls of 9 px. Random worlds are drawn instead, with other seeds than those of training, and the
patches of each view are refined with its lamp measured to 0.02 rad: with the networks for usual looks, and with those
for all looks. A ball is clear when more than 90% of its outline is visible.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import sqrt

import numpy as np
from rich.console import Console
from rich.progress import track

from bench.balls import CLEAR
from bench.detection_scoring import SURE_PX
from bench.tables import Bar, Grid, bars
from spinewatch.arrays import Bool, Float, Single
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.lighting import Lighting, lighting_inputs
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import BallNetwork, predict_turned
from spinewatch.detection.refinement.orientations import MIRRORED, ROTATED, UPRIGHT, mean_centres
from spinewatch.simulation.images.examples import Examples, random_examples
from spinewatch.simulation.images.families import UNUSUAL
from spinewatch.simulation.images.shots import ExampleParameters

WIDTH_PX = 20.0
LAMP_SD_RAD = 0.02
SURE_SHARE, RMS_PX = 0.8, 0.08
"""Bars: fraction of the clear balls that are sure, and RMS error per axis of these, px."""
_CHUNK = 200


@dataclass(frozen=True)
class LargeBalls:
    """Errors of n clear balls.

    ``found``: fraction that the upright network takes for a ball. ``sure``: fraction that is found with a stated
    deviation below 0.2 px. ``rms_px``, ``chi2_per_dof``: of the sure ones. ``median_px``: median absolute error per
    axis of all.
    """

    n: int
    found: float
    sure: float
    rms_px: float
    median_px: float
    chi2_per_dof: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.large_balls", description=__doc__)
    parser.add_argument(
        "--examples", type=int, default=4000, help="examples of all looks; half as many usual ones"
    )
    parser.add_argument("--check", action="store_true", help="exit 1 when a bar is missed")
    options = parser.parse_args(arguments)
    found = {
        "usual looks": measure(draw(options.examples // 2, UNUSUAL), usual=True),
        "all looks": measure(draw(options.examples, ()), usual=False),
    }
    checks = requirements(found["usual looks"])
    for grid in (table(found), bars(checks)):
        grid.print()
    return int(options.check and not all(check.holds for check in checks))


def draw(count: int, left_out: tuple[str, ...], seed: int = 2026) -> Examples:
    """Return examples of large balls."""
    grid = default_networks().refinement_networks(WIDTH_PX)[0].grid
    parameters = ExampleParameters(
        grid, (WIDTH_PX, WIDTH_PX), wider=WIDTH_PX, wider_share=0.0, left_out=left_out
    )
    rng = np.random.default_rng([seed, len(left_out)])
    sizes = [min(_CHUNK, count - start) for start in range(0, count, _CHUNK)]
    parts = [
        random_examples(rng, size, parameters)
        for size in track(sizes, "drawing", console=Console(stderr=True), transient=True)
    ]
    return Examples.concatenate(parts)


def measure(examples: Examples, *, usual: bool) -> LargeBalls:
    """Return the errors of the clear balls of examples, with the networks of usual looks or of all looks."""
    p = CentreParameters()
    balls = examples.take(examples.ball & (examples.visible > CLEAR))
    lamp = balls.lamp + LAMP_SD_RAD * np.random.default_rng(0).standard_normal((len(balls.lamp), 2))
    views = [np.flatnonzero(balls.image == image) for image in np.unique(balls.image)]
    parts = [_refined(balls.patches[view].astype(np.float32), lamp[view], p, usual=usual) for view in views]
    found, centre, covariance = (np.concatenate(values) for values in zip(*parts, strict=True))
    covariance = covariance + p.model_sd**2 * np.eye(2)
    error = centre - balls.offset
    radius = WIDTH_PX / 2
    sure = found & (radius * np.sqrt(covariance.diagonal(axis1=1, axis2=2)).max(axis=1) < SURE_PX)
    chi2 = np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error) / 2
    return LargeBalls(
        len(error),
        float(found.mean()),
        float(sure.mean()),
        radius * sqrt(float(np.square(error[sure]).mean())),
        radius * float(np.median(np.abs(error))),
        float(chi2[sure].mean()),
    )


def _refined(patches: Single, lamp: Float, p: CentreParameters, *, usual: bool) -> tuple[Bool, Float, Float]:
    """Return which balls (n,) of one view are found, and their centres (n, 2) and covariances (n, 2, 2), in radii."""
    networks = default_networks().refinement_networks(WIDTH_PX)
    predict = partial(predict_turned, patches=patches, lighting=_lighting(lamp, p))
    first: BallNetwork = networks[-1 if usual else 0]
    is_ball = predict(first, turn=UPRIGHT).in_view(p.min_odds)
    upright = predict(first, turn=UPRIGHT, is_ball=is_ball)
    is_ball = upright.in_view(p.min_odds)
    turns = (ROTATED,) if usual else (ROTATED, MIRRORED)
    turned = [predict(networks[0], turn=turn, is_ball=is_ball) for turn in turns]
    offsets, covariances = zip(*((e.offset, e.covariance) for e in (upright, *turned)), strict=True)
    mean = mean_centres(offsets, covariances, p.rotation_correlation)
    return upright.log_odds > 0, mean.centre, mean.covariance


def requirements(usual: LargeBalls) -> tuple[Bar, ...]:
    """Return the bars of usual looks."""
    return (
        Bar(
            f">= {SURE_SHARE:.0%} of clear balls of {WIDTH_PX:g} px are sure",
            f"{usual.sure:.1%}",
            usual.sure >= SURE_SHARE,
        ),
        Bar(f"sure ones within {RMS_PX} px RMS", f"{usual.rms_px:.3f} px", usual.rms_px <= RMS_PX),
    )


def table(found: dict[str, LargeBalls]) -> Grid:
    """Return the table of errors."""
    columns = ["", "clear balls", "found", "sure", "RMS of sure ones, px", "median error, px", "chi2 / dof"]
    rows = [
        (
            name,
            f.n,
            f"{f.found:.1%}",
            f"{f.sure:.1%}",
            f"{f.rms_px:.3f}",
            f"{f.median_px:.3f}",
            f"{f.chi2_per_dof:.2f}",
        )
        for name, f in found.items()
    ]
    return Grid.of(f"Simulated balls of {WIDTH_PX:g} px", columns, rows)


def _lighting(lamp: Float, p: CentreParameters) -> Lighting:
    """Return the light of n balls whose lamp (n, 2) is measured, at the usual height."""
    n = len(lamp)
    known = np.ones(n, dtype=bool)
    return Lighting(lighting_inputs(lamp, known, np.full(n, np.log(p.height)), known))


if __name__ == "__main__":
    sys.exit(main())
