"""The sound input that slips are made from: sample stages, shots of the peg board, rigs and point tables."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from spinewatch.camera import Camera

SAMPLES = Path(__file__).parents[2] / "samples"
BOARDS = SAMPLES / "calibration" / "C1"
STAGES = ("PRE", "INTER", "POST")
SIDES = ("left", "right")
LABELS = "L1,T11,T9,T7"
BOARD = "pegboard-1995"
IMAGE_HEADER = ("id", "x_mm", "y_mm", "z_mm", "u_px", "v_px")
FIELD_HEADER = IMAGE_HEADER[:4]

Gray = NDArray[np.uint8] | NDArray[np.uint16]
RigJson = dict[str, Any]
Row = list[str]
Table = list[Row]

PEGS_MM = (
    (0.000, 44.780, 14.858, 44.754, 29.794, 59.893),
    (44.780, 14.884, 104.902, 29.921, 89.839, 14.732),
    (29.895, 0.000, 45.110, 120.192, 30.073, 44.856),
    (59.994, 45.059, 90.195, 44.983, 104.952, 0.000),
    (15.113, 60.248, 30.124, 44.932, 14.985, 59.918),
)
"""Heights of the peg board of Table 3.2; the pegs are 127 mm apart."""


def rig() -> RigJson:
    """Return the rig JSON of the sample surgery."""
    document: RigJson = json.loads((SAMPLES / "D1" / "rig.json").read_text())
    return document


def changed_rig(change: Callable[[RigJson], object]) -> RigJson:
    """Return the sample's rig after a change in place."""
    document = deepcopy(rig())
    change(document)
    return document


def tiny_baseline(document: RigJson) -> None:
    """Place both cameras of a rig at one point but for 1e-300 mm."""
    document["left"]["position_mm"] = [0.0, 0.0, 740.0]
    document["right"]["position_mm"] = [1e-300, 0.0, 740.0]


def each_camera(key: str, value: Callable[[Any], Any]) -> Callable[[RigJson], None]:
    """Return the change that replaces one entry of both cameras by a function of it."""

    def change(document: RigJson) -> None:
        for side in SIDES:
            document[side][key] = value(document[side][key])

    return change


def camera_of(entry: Mapping[str, Any]) -> Camera:
    """Return the camera of one side of a rig JSON."""
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()
    }
    return Camera(**values)


def stage_files(stage: str) -> tuple[Path, Path]:
    """Return the files of a sample stage."""
    return SAMPLES / "D1" / stage / "left.png", SAMPLES / "D1" / stage / "right.png"


def board_files(trial: str) -> tuple[Path, Path]:
    """Return the files of a shot of the peg board."""
    return BOARDS / trial / "left.png", BOARDS / trial / "right.png"


def pixels(path: Path) -> NDArray[np.uint8]:
    """Return the gray levels of an image."""
    return np.array(Image.open(path).convert("L"))


def stage_pixels(stage: str) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the gray levels of a sample stage."""
    left, right = stage_files(stage)
    return pixels(left), pixels(right)


def write_png(path: Path, image: NDArray[Any]) -> Path:
    """Write gray levels, clipped and rounded, as a PNG of 8 bits, or of 16 for uint16."""
    if image.dtype != np.uint16:
        image = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    Image.fromarray(image).save(path)
    return path


def write_rig(folder: Path, document: Mapping[str, Any]) -> Path:
    """Write a rig JSON into a folder."""
    path = folder / "rig.json"
    path.write_text(json.dumps(document, indent=1))
    return path


def process_arguments(
    images: Sequence[Path], rig_path: Path | None = None, labels: str | None = LABELS, axis: str = "x"
) -> list[object]:
    """Return the arguments of ``spinewatch process``; the sample's rig unless another is given."""
    rig_path = rig_path or SAMPLES / "D1" / "rig.json"
    named = [] if labels is None else ["--labels", labels]
    return [*images, "--rig", rig_path, *named, "--spine-axis", axis]


def peg_points() -> dict[str, NDArray[np.float64]]:
    """Return the control points of the peg board by id, mm."""
    return {
        str(6 * row + column + 1): np.array([127.0 * column, 127.0 * (4 - row), height])
        for row, heights in enumerate(PEGS_MM)
        for column, height in enumerate(heights)
    }


def point_tables(
    document: RigJson, noise_px: float = 0.03, seed: int = 11, tilt_deg: float = 0.0
) -> tuple[Table, Table]:
    """Return the tables of image points of the peg board in both cameras of a rig, the header first.

    Points outside either image, by 8 px or more, are left out; ``tilt_deg`` turns the board about its Y axis
    through its middle, a second shot of which only the image points change.
    """
    rng = np.random.default_rng(seed)
    points = peg_points()
    ids = list(points)
    placed = np.stack([points[i] for i in ids])
    middle, angle = placed.mean(axis=0), np.radians(tilt_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    seen = (placed - middle) @ turn.T + middle
    images = [camera_of(document[side]).project(seen) for side in SIDES]
    inside = np.ones(len(ids), dtype=bool)
    for side, image in zip(SIDES, images, strict=True):
        size = np.array(document[side]["image_size_px"])
        inside &= np.all((image > 8) & (image < size - 9), axis=1)
    tables = []
    for image in images:
        noisy = image + noise_px * rng.standard_normal(image.shape)
        rows = [
            [ids[i], *(f"{c:.3f}" for c in placed[i]), *(f"{c:.3f}" for c in noisy[i])]
            for i in np.flatnonzero(inside)
        ]
        tables.append([list(IMAGE_HEADER), *rows])
    return tables[0], tables[1]


def field_table() -> Table:
    """Return the table of the peg board's control points, the header first."""
    rows = [[id_, *(f"{c:.3f}" for c in point)] for id_, point in peg_points().items()]
    return [list(FIELD_HEADER), *rows]


def csv_text(table: Table, delimiter: str = ",") -> str:
    """Return a table as CSV text with quotes where they are needed."""
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator="\n").writerows(table)
    return out.getvalue()


def columns_changed(table: Table, columns: Sequence[str], change: Callable[[float], float]) -> Table:
    """Return a table with a function applied to the numbers of some columns, three decimals kept."""
    header, *rows = table
    places = [header.index(name) for name in columns]
    return [
        header,
        *(
            [f"{change(float(cell)):.6f}" if i in places else cell for i, cell in enumerate(row)]
            for row in rows
        ),
    ]
