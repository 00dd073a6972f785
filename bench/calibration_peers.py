"""The same points calibrated by five methods: image RMS, residuals in and out of sample, time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np

from bench.calibration_boards import calibrated, moved_board
from bench.peers.opencv import opencv_camera, triangulate
from bench.peers.tsai import tsai_two_stage
from bench.peers.two_plane import intersect_lines, two_plane
from bench.tables import Bar, Grid
from bench.thesis.calibration import TYPICAL, table_shot
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import common_points, reconstruct
from spinewatch.calibration.solve.dlt import solve_dlt
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.camera import Camera, Rig
from spinewatch.geometry.transforms import RigidTransform, fit_rigid
from spinewatch.simulation.rigs import table_3_3_rig

Reconstruct = Callable[[Float, Float], Float]


def compare(boards: Path) -> list[Bar]:
    """Print the comparison; out of sample, ours must be no worse than ``PEERS``; the DLT is its first initial value."""
    result = calibrated(boards)
    first, others = result.calibration.shots[0], result.held_out
    camera = result.calibration.rig.left
    sensor = Sensor(camera.image_size_px, camera.pixel_size_mm)
    rows, fresh = [], {}
    for name, method in METHODS.items():
        start = perf_counter()
        rms, reconstructed = method(first, sensor)
        seconds = perf_counter() - start
        inside = _std([first], reconstructed, rigid=False)
        fresh[name] = _std(others, reconstructed, rigid=True)
        rows.append(
            (
                name,
                "-" if np.isnan(rms) else f"{rms:.3f}",
                _text(inside),
                _text(fresh[name]),
                f"{seconds * 1e3:.0f}",
            )
        )
    Grid.of(
        f"Calibrated on trial {first.name}, {len(others)} other trials fresh",
        ["method", "image RMS px", "in sample std mm", "fresh std mm", "ms"],
        rows,
    ).print()
    best = min(np.linalg.norm(v) for n, v in fresh.items() if n in PEERS)
    own = float(np.linalg.norm(fresh[OURS]))
    return [
        Bar(
            "fresh std no worse than Tsai's, two-plane's and OpenCV's",
            f"{own:.4f} against {best:.4f} mm",
            bool(own <= best),
        )
    ]


def against_dlt(runs: int = 40, sigma_px: float = 0.025) -> list[Bar]:
    """Print the full method beside the DLT on simulated boards; few trials do not separate them."""
    rng = np.random.default_rng(0)
    rig, control = table_3_3_rig(), pegboard_1995().take(TYPICAL)
    sensor = Sensor(rig.left.image_size_px, rig.left.pixel_size_mm)
    fresh: dict[str, list[Float]] = {OURS: [], "DLT with K1 alone": []}
    for _ in range(runs):
        placements = [RigidTransform.identity(), *(moved_board(rng, control.mean(axis=0)) for _ in range(4))]
        shots = [table_shot(str(k), TYPICAL, p(control), sigma_px, rng) for k, p in enumerate(placements)]
        for name, found in fresh.items():
            found.append(_std(shots[1:], METHODS[name](shots[0], sensor)[1], rigid=True))
    gain = np.diff([np.linalg.norm(v, axis=1) for v in fresh.values()], axis=0)[0]
    Grid.of(
        f"Simulated boards of {len(TYPICAL)} pegs, {sigma_px:g} px, {runs} runs of five trials",
        ["method", "fresh std mm"],
        [(name, _text(np.sqrt(np.mean(np.square(v), axis=0)))) for name, v in fresh.items()],
    ).print()
    error = gain.std(ddof=1) / np.sqrt(runs)
    return [
        Bar(
            "simulated boards: fresh std no worse than the DLT's alone",
            f"{-gain.mean():+.4f} +- {error:.4f} mm, better in {np.mean(gain > 0):.0%}",
            bool(gain.mean() > 0),
        )
    ]


def _ours(shot: Shot, sensor: Sensor) -> tuple[float, Reconstruct]:
    calibration = calibrate_stereo([shot], (sensor, sensor))
    return calibration.adjustment.rms_px, lambda a, b: reconstruct(calibration.rig, a, b)


def _dlt(shot: Shot, sensor: Sensor) -> tuple[float, Reconstruct]:
    return _cameras(shot, solve_dlt(shot.left, sensor).camera, solve_dlt(shot.right, sensor).camera)


def _tsai(shot: Shot, sensor: Sensor) -> tuple[float, Reconstruct]:
    return _cameras(shot, tsai_two_stage(shot.left, sensor), tsai_two_stage(shot.right, sensor))


def _cameras(shot: Shot, left: Camera, right: Camera) -> tuple[float, Reconstruct]:
    rig = Rig("peer", left, right)
    return _image_rms(shot, left.project, right.project), lambda a, b: reconstruct(rig, a, b)


def _two_plane(shot: Shot, sensor: Sensor) -> tuple[float, Reconstruct]:
    left, right = two_plane(shot.left), two_plane(shot.right)
    return float("nan"), lambda a, b: intersect_lines(left, right, a, b)


def _opencv(shot: Shot, sensor: Sensor) -> tuple[float, Reconstruct]:
    left, right = (
        opencv_camera([image], sensor, solve_dlt(image, sensor).camera.focal_length_mm)
        for image in (shot.left, shot.right)
    )
    return _image_rms(shot, left.project, right.project), lambda a, b: triangulate(left, right, a, b)


PEERS = ("Tsai, two-stage", "Wei-Ma, two-plane", "OpenCV calibrateCamera")
OURS = "collinearity (ours)"
METHODS: dict[str, Callable[[Shot, Sensor], tuple[float, Reconstruct]]] = {
    OURS: _ours,
    "DLT with K1 alone": _dlt,
    "Tsai, two-stage": _tsai,
    "Wei-Ma, two-plane": _two_plane,
    "OpenCV calibrateCamera": _opencv,
}


def _image_rms(shot: Shot, left: Callable[[Float], Float], right: Callable[[Float], Float]) -> float:
    def residuals(image: ImagePoints, project: Callable[[Float], Float]) -> Float:
        return (project(image.control_mm) - image.pixels).ravel()

    return float(
        np.sqrt(np.mean(np.concatenate([residuals(shot.left, left), residuals(shot.right, right)]) ** 2))
    )


def _std(shots: list[Shot] | tuple[Shot, ...], reconstructed: Reconstruct, *, rigid: bool) -> Float:
    """Return the root mean square over shots of the standard deviation per axis (3,)."""
    squares = []
    for shot in shots:
        _, control, left, right = common_points(shot)
        points = reconstructed(left, right)
        if rigid:
            points = fit_rigid(points, control)(points)
        squares.append((points - control).std(axis=0, ddof=1) ** 2)
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


def _text(sd: Float) -> str:
    return " / ".join(f"{v:.3f}" for v in sd)
