"""Slips of the rig and of the pair: ``process`` of sample stages with what does not belong together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.slips.slip import Kind, Right, Slip
from bench.slips.sound import (
    SIDES,
    RigJson,
    camera_of,
    changed_rig,
    each_camera,
    process_arguments,
    stage_files,
    stage_pixels,
    tiny_baseline,
    write_png,
    write_rig,
)

Change = Callable[[RigJson], object]

_DRIFT = Right(flags=("calibration-drift",))
_NOT_THIS_RIG = Right(refusal=r"rig|calibration", flags=("no-triads", "calibration-drift"))
_SWAPPED = Right(refusal=r"exchange|swap", flags=("no-triads",), detail=r"exchange|swap")


def slips() -> Iterator[Slip]:
    """Yield the slips of rig, swap and unit."""
    yield from _drifts()
    yield from _swaps()
    yield from _units()
    yield from _impossible()
    yield from _turned()
    yield from _ranges()


def _drifts() -> Iterator[Slip]:
    for stage, degrees in (("PRE", 0.5), ("INTER", 0.3), ("POST", -0.3), ("POST", 1.0)):
        yield _with_rig(
            f"right camera yawed by {degrees:g} degrees", "rig", stage, _turn("right", 1, degrees), _DRIFT
        )
    yield _with_rig("left camera yawed by 0.4 degrees", "rig", "INTER", _turn("left", 1, 0.4), _DRIFT)
    for stage, degrees in (("PRE", 0.1), ("INTER", -0.2), ("POST", 0.5)):
        yield _with_rig(
            f"right camera pitched by {degrees:g} degrees",
            "rig",
            stage,
            _turn("right", 0, degrees),
            _NOT_THIS_RIG,
        )
    yield _with_rig("right camera rolled by 0.3 degrees", "rig", "PRE", _turn("right", 2, 0.3), _DRIFT)
    for stage, share in (("INTER", 0.01), ("PRE", -0.01), ("POST", 0.03)):
        yield _with_rig(f"base changed by {100 * share:+g}%", "rig", stage, _base(share), _DRIFT)
    yield _with_rig(
        "focal length of the right camera 1.5% too long",
        "rig",
        "PRE",
        lambda r: r["right"].update(focal_length_mm=r["right"]["focal_length_mm"] * 1.015),
        _DRIFT,
    )
    yield _with_rig("rotations of both cameras transposed", "rig", "INTER", _transposed, _NOT_THIS_RIG)


def _swaps() -> Iterator[Slip]:
    for stage in ("PRE", "INTER"):
        yield _pair("left and right exchanged", "swap", stage, tuple(reversed(stage_files(stage))), _SWAPPED)
    yield _with_rig("cameras exchanged in the rig", "swap", "POST", _exchange, _SWAPPED)
    mixed = Right(refusal=r"moment|same|belong", flags=("no-triads", "pair-mixed", "calibration-drift"))
    for a, b in (("PRE", "POST"), ("INTER", "PRE"), ("POST", "INTER")):
        images = (stage_files(a)[0], stage_files(b)[1])
        yield _pair(f"left of {a} with right of {b}", "swap", a, images, mixed)
    yield _with_rig("the rig of another cart", "swap", "INTER", _other_cart, _NOT_THIS_RIG)
    yield _with_rig("the rig of another set-up of this cart", "swap", "PRE", _other_set_up, _NOT_THIS_RIG)


def _units() -> Iterator[Slip]:
    base = Right(
        refusal=r"baseline|position_mm|metre|unit", flags=("no-triads",), detail=r"unit|metre|10\^?3|1000"
    )
    pixel = Right(refusal=r"pixel_size_mm|pixel|micrometre", flags=("no-triads",), detail=r"pixel|unit")
    angle = Right(
        refusal=r"rotation_deg|radian|vergence|axes|field", flags=("no-triads",), detail=r"radian|rotation"
    )
    focal = Right(refusal=r"focal_length_mm|field of view|principal|unit")
    yield _with_rig(
        "pixel size in micrometres", "unit", "PRE", each_camera("pixel_size_mm", _times(1000)), pixel
    )
    yield _with_rig(
        "pixel size in metres", "unit", "POST", each_camera("pixel_size_mm", _times(0.001)), pixel
    )
    yield _with_rig("positions in metres", "unit", "INTER", each_camera("position_mm", _times(0.001)), base)
    yield _with_rig("positions in centimetres", "unit", "PRE", each_camera("position_mm", _times(0.1)), base)
    yield _with_rig("positions in inches", "unit", "POST", each_camera("position_mm", _times(1 / 25.4)), base)
    yield _with_rig(
        "angles in radians", "unit", "INTER", each_camera("rotation_deg", _times(np.pi / 180)), angle
    )
    yield _with_rig(
        "focal length in pixels", "unit", "PRE", each_camera("focal_length_mm", lambda f: f * 100), focal
    )
    yield _with_rig(
        "focal length in metres", "unit", "POST", each_camera("focal_length_mm", lambda f: f / 1000), focal
    )
    centre = Right(refusal=r"principal_point_mm|principal point")
    yield _with_rig(
        "principal point in pixels",
        "unit",
        "POST",
        each_camera("principal_point_mm", lambda _: [289.6, 198.3]),
        centre,
    )
    square = Right(refusal=r"pixel_size_mm", flags=("no-triads", "calibration-drift"))
    yield _with_rig(
        "square pixels assumed", "unit", "INTER", each_camera("pixel_size_mm", lambda _: [0.01, 0.01]), square
    )


def _impossible() -> Iterator[Slip]:
    cases: tuple[tuple[str, Change, str], ...] = (
        ("both cameras look away from the field", each_camera("rotation_deg", _away), r"rotation_deg|look"),
        ("the right camera looks away", _turn("right", 0, 180.0), r"right\.rotation_deg|look"),
        (
            "the cameras diverge",
            each_camera("rotation_deg", lambda a: [a[0], -a[1], a[2]]),
            r"rotation_deg|diverge|meet|field",
        ),
        ("pixels of 10 mm", each_camera("pixel_size_mm", lambda _: [10.0, 8.45]), r"pixel_size_mm"),
        ("focal length 1e12", each_camera("focal_length_mm", lambda _: 1e12), r"focal_length_mm"),
        ("baseline 1e-300", tiny_baseline, r"position_mm|baseline"),
        ("the left camera given twice", _left_twice, r"position_mm|baseline"),
        ("a baseline of 40 m", _base(95.0), r"position_mm|baseline|range"),
        (
            "distortion that folds the image",
            each_camera("radial", lambda _: [-0.09, 0.0]),
            r"radial|distortion|fold",
        ),
        (
            "an integer of 400 digits",
            lambda r: r["left"].update(focal_length_mm=10**400),
            r"focal_length_mm|finite|JSON",
        ),
    )
    for name, change, pattern in cases:
        yield _with_rig(name, "rig", "PRE", change, Right(refusal=pattern))


def _turned() -> Iterator[Slip]:
    whole = Right(refusal=r"mirror|upside|turned", flags=("no-triads",), detail=r"mirror|upside|turned")
    yield _changed("both images upside down", "swap", "PRE", (_half_turn, _half_turn), whole)
    yield _changed("both images mirrored", "swap", "INTER", (np.fliplr, np.fliplr), whole)
    one = Right(refusal=r"mirror|upside|turned", flags=("no-triads",))
    yield _changed("the right image mirrored", "swap", "POST", (_same, np.fliplr), one)
    yield _changed("the right image upside down", "swap", "POST", (_same, _half_turn), one)
    rows = Right(flags=("no-triads", "calibration-drift"))
    yield _changed(
        "right image shifted by 3 rows", "rig", "PRE", (_same, lambda a: np.roll(a, 3, axis=0)), rows
    )
    noise = np.random.default_rng(7)
    same = Right(refusal=r"same image", flags=("pair-same",))
    yield Slip(
        "the left image twice, with other noise",
        "swap",
        "PRE",
        "process",
        same,
        lambda folder: process_arguments(
            (
                stage_files("PRE")[0],
                write_png(folder / "r.png", stage_pixels("PRE")[0] + noise.normal(0, 1.0, (416, 568))),
            )
        ),
    )


def _ranges() -> Iterator[Slip]:
    named = Right(flags=("no-triads",), detail=r"range of .* given")
    for stage, text in (("PRE", "500,600"), ("INTER", "300,450"), ("POST", "63,76"), ("PRE", "900,1200")):
        yield Slip(
            f"--range {text}, {stage}",
            "unit",
            stage,
            "process",
            named,
            _with_range(stage, text),
        )


def _with_range(stage: str, text: str) -> Callable[[Path], Sequence[object]]:
    return lambda _: [*process_arguments(stage_files(stage)), "--range", text]


def _with_rig(name: str, kind: Kind, stage: str, change: Change, right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        return process_arguments(stage_files(stage), write_rig(folder, changed_rig(change)))

    return Slip(f"{name}, {stage}", kind, stage, "process", right, make)


def _pair(name: str, kind: Kind, stage: str, images: Sequence[Path], right: Right) -> Slip:
    return Slip(f"{name}, {stage}", kind, stage, "process", right, lambda _: process_arguments(images))


def _changed(
    name: str, kind: Kind, stage: str, changes: Sequence[Callable[[Any], Any]], right: Right
) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        images = [
            write_png(folder / f"{side}.png", change(image))
            for side, image, change in zip(SIDES, stage_pixels(stage), changes, strict=True)
        ]
        return process_arguments(images)

    return Slip(f"{name}, {stage}", kind, stage, "process", right, make)


def _turn(side: str, angle: int, degrees: float) -> Change:
    def change(document: RigJson) -> None:
        document[side]["rotation_deg"][angle] += degrees

    return change


def _base(share: float) -> Change:
    def change(document: RigJson) -> None:
        left, right = (np.array(document[side]["position_mm"]) for side in SIDES)
        document["right"]["position_mm"] = (right + share * (right - left)).tolist()

    return change


def _exchange(document: RigJson) -> None:
    document["left"], document["right"] = document["right"], document["left"]


def _other_cart(document: RigJson) -> None:
    for side, x, phi in (("left", 230.0, -12.0), ("right", 550.0, 12.0)):
        document[side] |= {
            "position_mm": [x, 400.0, 820.0],
            "rotation_deg": [0.0, phi, 0.0],
            "focal_length_mm": 8.4,
        }


def _other_set_up(document: RigJson) -> None:
    for side, angles in (("left", [-4.2, -18.1, 2.6]), ("right", [-5.3, 13.9, -0.4])):
        document[side]["rotation_deg"] = angles


def _left_twice(document: RigJson) -> None:
    x, y, z = document["left"]["position_mm"]
    document["right"] = {**document["left"], "position_mm": [x + 0.01, y, z]}


def _away(angles: list[float]) -> list[float]:
    return [angles[0] + 180.0, angles[1], angles[2]]


def _transposed(document: RigJson) -> None:
    """Replace OpenCV's R, object space to camera, by its transpose, and keep its t."""
    flip = np.diag([1.0, -1.0, -1.0])
    for side in SIDES:
        camera = camera_of(document[side])
        R = flip @ camera.M
        M = flip @ R.T
        document[side]["position_mm"] = (R @ R @ camera.centre).tolist()
        angles = np.arctan2(-M[2, 1], M[2, 2]), np.arcsin(M[2, 0]), np.arctan2(-M[1, 0], M[0, 0])
        document[side]["rotation_deg"] = np.degrees(angles).tolist()


def _times(factor: float) -> Callable[[list[float]], list[float]]:
    return lambda values: [factor * value for value in values]


def _half_turn(image: Any) -> Any:
    return image[::-1, ::-1]


def _same(image: Any) -> Any:
    return image
