"""Real coordinates: OpenPTV's cavity (in relief, through glass and water) and OpenCV's chessboards (planes)."""

from __future__ import annotations

from pathlib import Path
from time import process_time

import numpy as np

from bench.peers.opencv import opencv_camera, opencv_stereo
from bench.tables import Bar, Grid
from spinewatch.arrays import Bool
from spinewatch.calibration.errors import PlanarFieldError
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import Sensor, Shot
from spinewatch.calibration.solve.blunders import Blunder, BlunderParameters
from spinewatch.calibration.solve.collinearity import THESIS_NAMES
from spinewatch.calibration.solve.dlt import solve_dlt
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.solve.resection import resect
from spinewatch.calibration.stereo import calibrate_stereo

CAVITY = Sensor((1280, 1024), (0.012, 0.012))
CAVITY_BARS_PX = (0.28, 0.24, 0.37, 0.38)
GROSS_PX = 5.0
CHESSBOARD = Sensor((640, 480), (0.01, 0.01))
CHESSBOARD_BAR_PX = 0.444
MAX_TIME_RATIO = 3.0


def openptv(folder: Path) -> list[Bar]:
    """Resect the four cameras of the cavity with the thirteen parameters of the thesis."""
    rows, rms, removed = [], [], {}
    for k, bar in enumerate(CAVITY_BARS_PX, 1):
        (points,) = parse_image_points((folder / f"cam{k}.csv").read_text(), f"cam{k}").values()
        direct = solve_dlt(points, CAVITY)
        found = resect([points], CAVITY, SolveParameters(free=THESIS_NAMES), f"camera {k}")
        peer = opencv_camera(
            [points.keep(_kept(points.ids, found.blunders))], CAVITY, direct.camera.focal_length_mm
        )
        named = {b.id: b.residual_px for b in found.blunders}
        removed[k] = named
        rms.append(found.adjustment.rms_px)
        rows.append(
            (k, len(points), f"{rms[-1]:.3f}", f"{bar:.2f}", f"{peer.rms_px / np.sqrt(2):.3f}",
             ", ".join(f"{i} ({r:.1f} px)" for i, r in named.items()))
        )  # fmt: skip
    Grid.of(
        "OpenPTV cavity, RMS per coordinate",
        ["camera", "points", "ours px", "bar", "OpenCV, same points", "removed"],
        rows,
    ).print()
    ok = [r <= bar for r, bar in zip(rms, CAVITY_BARS_PX, strict=True)]
    gross = {k: [i for i, r in named.items() if r > GROSS_PX] for k, named in removed.items()}
    return [
        Bar(
            f"cavity RMS <= {' / '.join(map(str, CAVITY_BARS_PX))} px, each camera",
            " / ".join(f"{r:.3f}" for r in rms),
            all(ok),
        ),
        Bar(
            f"mismatches over {GROSS_PX:g} px in cameras 2 and 3 removed and named",
            f"2: {gross[2]}, 3: {gross[3]}",
            bool(gross[2] and gross[3]),
        ),
    ]


def chessboards(folder: Path) -> list[Bar]:
    """Refuse one plane; solve thirteen tilted ones with free placements, beside stereoCalibrate."""
    left, right = (
        parse_image_points((folder / f"{side}.csv").read_text(), side) for side in ("left", "right")
    )
    refused = "solved"
    try:
        resect([left["1"]], CHESSBOARD, SolveParameters())
    except PlanarFieldError as error:
        refused = error.code
    parameters = SolveParameters(blunders=BlunderParameters(enabled=False))
    shots = [Shot(name, left[name], right[name]) for name in left]
    start = process_time()
    ours = calibrate_stereo(shots, (CHESSBOARD, CHESSBOARD), parameters).adjustment.rms_px * np.sqrt(2)
    between = process_time()
    single = tuple(opencv_camera(list(images.values()), CHESSBOARD, None) for images in (left, right))
    peer, _, _ = opencv_stereo(list(left.values()), list(right.values()), (single[0], single[1]), CHESSBOARD)
    ours_s, peer_s = between - start, process_time() - between
    Grid.of(
        "Chessboards, 13 pairs, RMS per point",
        ["", "px", "CPU s"],
        [("ours", f"{ours:.6f}", f"{ours_s:.2f}"), ("stereoCalibrate", f"{peer:.6f}", f"{peer_s:.2f}")],
    ).print()
    return [
        Bar("one view of a plane is refused", refused, refused == PlanarFieldError.code),
        Bar(
            f"thirteen views: RMS <= {CHESSBOARD_BAR_PX} px to three decimals, no worse than stereoCalibrate's",
            f"{ours:.6f} against {peer:.6f} px",
            round(float(ours), 3) <= CHESSBOARD_BAR_PX and bool(ours <= peer),
        ),
        Bar(
            f"thirteen views: CPU time <= {MAX_TIME_RATIO:g} times OpenCV's",
            f"{ours_s:.2f} against {peer_s:.2f} s",
            ours_s <= MAX_TIME_RATIO * peer_s,
        ),
    ]


def _kept(ids: tuple[str, ...], blunders: tuple[Blunder, ...]) -> Bool:
    gone = {b.id for b in blunders}
    return np.array([i not in gone for i in ids])
