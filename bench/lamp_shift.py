"""``python -m bench.lamp_shift DIR...``: displacement of the networks' centres towards the lamp in rendered pairs.

The median error of the sure centres of a view is compared with the direction of the lamp that its rig makes probable.
The table gives the coefficient k of k s |l| l, radii, for the direction l and stated standard deviations s. Where k
differs from zero by more than its error, all triads of such pairs are displaced in depth (docs/looks.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.balls import CLEAR, BallScene, find_ball_scenes
from bench.detection_scoring import SURE_PX, nearest
from bench.scoring import FEATURE_PX
from bench.tables import Grid
from spinewatch.arrays import Float
from spinewatch.detection.detector import prepare_detector
from spinewatch.imaging.frame import Frame
from spinewatch.matching.epipolar import nominal_ranges_mm
from spinewatch.parameters import Parameters

_MIN_BALLS = 3


@dataclass(frozen=True, eq=False)
class Displacement:
    """Median errors (n, 2) of the sure centres of n views, radii, and median s |l| l (n, 2) of them, radii."""

    error: Float
    lamp: Float

    @property
    def coefficient(self) -> tuple[float, float]:
        """Least-squares coefficient and its standard deviation."""
        k = float((self.lamp * self.error).sum() / np.square(self.lamp).sum())
        residual = np.square(self.error - k * self.lamp).sum() / (self.error.size - 1)
        return k, float(np.sqrt(residual / np.square(self.lamp).sum()))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.lamp_shift", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="+")
    options = parser.parse_args(arguments)
    rows = []
    for root in options.directory:
        found = measure(list(find_ball_scenes(root)))
        if not len(found.error):
            parser.error(f"no pairs with sure centres under {root}")
        k, sd = found.coefficient
        rms = np.sqrt(np.square(found.error).mean(axis=0))
        rows.append((root, len(found.error), f"{k:.1f} ± {sd:.1f}", f"{rms[0]:.4f}, {rms[1]:.4f}"))
    columns = ["pairs", "views", "k", "RMS of the views' median errors, u, v"]
    Grid.of("Displacement towards the lamp, radii", columns, rows).print()
    return 0


def measure(scenes: Sequence[BallScene]) -> Displacement:
    """Return the displacement in scenes."""
    p, error, lamp = Parameters(), [], []
    with ThreadPoolExecutor(max_workers=1) as pool:
        for scene in scenes:
            rig = scene.scene.rig
            ranges = nominal_ranges_mm(rig, p.search.matching.epipolar)
            detector = prepare_detector(rig, ranges, p.ball_diameter_mm, p.detection, p.centres)
            left, right = (Frame(view.image, view.side) for view in scene.views)
            for view, nominal, found in zip(
                scene.views, detector.views, detector.detect(left, right, pool), strict=True
            ):
                apart, index = nearest(view.centres_px[view.fraction > CLEAR], found.features.xy_px)
                variance = np.diagonal(found.features.covariance_px2, axis1=1, axis2=2)
                sd = np.sqrt(variance.max(axis=1))
                sure = (np.linalg.norm(apart, axis=1) < FEATURE_PX) & (sd[index] < SURE_PX)
                if sure.sum() >= _MIN_BALLS:
                    radius = np.array(view.ball_px) / 2
                    error.append(np.median(apart[sure], axis=0) / radius)
                    stated = np.median(np.sqrt(variance[index][sure].mean(axis=1))) / radius.mean()
                    lamp.append(stated * np.linalg.norm(nominal.lamp) * nominal.lamp)
    return Displacement(np.array(error), np.array(lamp))


if __name__ == "__main__":
    sys.exit(main())
