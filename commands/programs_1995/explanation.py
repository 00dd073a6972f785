"""What the programs of 1995 wrote beside their results: images of each step, points, residuals, verdicts."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from commands.shared.files import make_folder, write_bytes, write_text
from commands.shared.pixels import gray_levels
from spinewatch.arrays import Float, Floating, Pixels
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.imaging.frame import Frame
from spinewatch.imaging.sun_raster import encode_sun_raster
from spinewatch.thesis_1995.data_files import (
    FeatureList,
    MatchCoordinates,
    format_features,
    format_match_coordinates,
    format_residuals,
    format_triads,
    format_world_points,
)
from spinewatch.thesis_1995.detect_point import DetectPoint
from spinewatch.thesis_1995.match_point import MatchPoint
from spinewatch.thesis_1995.matching_files import format_candidate_sets, format_triplets

_LOG_WIDTH = 100
_RADIUS_PX = 8
_MATCH, _REMAINS, _DISCARDED = (115, 158, 0), (0, 159, 230), (160, 160, 160)
"""Blue, green and red of a match, of the feature and candidates that remain, and of those that were discarded."""


def write_detection(found: DetectPoint, folder: Path, prefix: str = "") -> None:
    """Write the images of DETECT-POINT as Sun rasters, decision spaces scaled to 0-255."""
    make_folder(folder)
    edges = found.preprocessed.edges
    images: dict[str, Pixels] = {
        "pre": _levels(found.preprocessed.gray, 1.0),
        "edge": _levels(edges, 255 / max(float(edges.max()), 1.0)),
        "crossGl": _levels(found.gray_decision, 255),
        "crossEd": _levels(found.edge_decision, 255),
        "final": _levels(found.feature_pixels, 255),
    }
    for name, image in images.items():
        write_bytes(folder / f"{prefix}{name}.ras", encode_sun_raster(image))


def write_matching(found: MatchPoint, left: Features, right: Features, rig: Rig, folder: Path) -> None:
    """Write the files of MATCH-POINT: features, candidates, matches, points, residuals, triplets, triads."""
    make_folder(folder)
    plates = [
        camera.undistort(camera.plate(side.xy_px[index]))
        for camera, side, index in ((rig.left, left, found.left), (rig.right, right, found.right))
    ]
    pairs = MatchCoordinates(found.left, found.right, plates[0], plates[1])
    texts = {
        "PixelsLEFT.dat": format_features(FeatureList(left.xy_px, left.score)),
        "PixelsRIGHT.dat": format_features(FeatureList(right.xy_px, right.score)),
        "MatchCoords.dat": format_match_coordinates(pairs),
        "WorldPoints.dat": format_world_points(found.points.position_mm),
        "SpacoOUT.dat": format_residuals(found),
        "SpineStage.dat": format_triads(found),
        "CandidateSets.dat": format_candidate_sets(found),
        "Triplets.dat": format_triplets(found),
    }
    for name, text in texts.items():
        write_text(folder / name, text)


def draw_matching(
    found: MatchPoint, features: tuple[Features, Features], frames: tuple[Frame, Frame], folder: Path
) -> None:
    """Draw, for each left feature, both images with its candidate set, refined set and match (figs 5.8 to 5.13).

    A candidate that the refinement discards is gray, one that remains orange, the match in a triad green.
    """
    gray = [gray_levels(frame.gray()) for frame in frames]
    beside = gray[0].shape[1]
    both = np.hstack([np.pad(image, ((0, max(len(g) for g in gray) - len(image)), (0, 0))) for image in gray])
    matches = {left: right for triad in found.triads for left, right in found.features[triad.triplet].pairs}
    for i, place in enumerate(features[0].xy_px):
        drawn: Pixels = np.repeat(both[..., None], 3, axis=2)
        _mark(drawn, place, i, _MATCH if i in matches else _REMAINS)
        for j in np.flatnonzero(found.sets.pairs[i]):
            remains = _REMAINS if found.refined.pairs[i, j] else _DISCARDED
            colour = _MATCH if matches.get(i) == j else remains
            _mark(drawn, features[1].xy_px[j] + [beside, 0], int(j), colour)
        write_bytes(folder / f"sets-left-{i + 1:02}.png", bytes(cv2.imencode(".png", drawn)[1]))


def _mark(image: Pixels, place: Float, index: int, colour: tuple[int, int, int]) -> None:
    """Draw a circle about a feature, with its number from 1."""
    u, v = (round(float(x)) for x in place)
    cv2.circle(image, (u, v), _RADIUS_PX, colour, 1, cv2.LINE_AA)
    at = (u + _RADIUS_PX, v - _RADIUS_PX)
    cv2.putText(image, str(index + 1), at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)


def print_triplets(found: MatchPoint) -> None:
    """Print candidate sets in numbers, and each triplet with its error and verdict, as in Tables 5.4 to 5.6."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=_LOG_WIDTH)
    candidates, refined = (int(sets.pairs.sum()) for sets in (found.sets, found.refined))
    console.print(f"{candidates} candidates, {refined} after refinement, {len(found.triplets)} triplets")
    table = Table(box=box.SIMPLE, show_edge=False, padding=(0, 1, 0, 0))
    for column in (
        "triad",
        "error (mm)",
        "XX (L)",
        "XX (R)",
        "YY (L)",
        "YY (R)",
        "MX (L)",
        "MX (R)",
        "heuristic",
    ):
        table.add_column(column, justify="right", no_wrap=True)
    for number, (triplet, verdict) in enumerate(zip(found.features, found.selection.verdicts, strict=True)):
        pairs = [str(index + 1) for pair in triplet.pairs for index in pair]
        table.add_row(str(number), f"{triplet.error_mm:.2f}", *pairs, verdict)
    console.print(table)
    for triad in found.triads:
        position = " ".join(f"{x:.2f}" for x in triad.position_mm)
        normal = " ".join(f"{x:.4f}" for x in triad.normal)
        console.print(f"{triad.label or '-':4} P {position} mm, normal {normal}")
    if not found.selection.complete:
        console.print("The number of triads is not that of the labels (H5): no triad has a label.")


def _levels(image: Floating, factor: float) -> Pixels:
    levels: Pixels = np.clip(np.rint(np.asarray(image) * factor), 0, 255).astype(np.uint8)
    return levels
