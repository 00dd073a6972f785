"""Rendered scenes and their truth."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.rig_files.rig_json import parse_rig, rig_from_dict


@dataclass(frozen=True, eq=False)
class TrueTriad:
    """Pose of a placed triad in object space, mm, and its ball centres, px, by name and side.

    ``visible``: both images show all three balls. ``visible_in``: names of the balls that the image of a side shows.
    """

    vertebra: str
    position_mm: Float
    rotation: Float
    visible: bool
    centre_px: Mapping[str, Mapping[str, Float]]
    visible_in: Mapping[str, frozenset[str]]


@dataclass(frozen=True, eq=False)
class Scene:
    """A stereo pair with its rig and its true triads in label order."""

    folder: Path
    rig: Rig
    exposure: str
    spine_axis: Literal["x", "y", "auto"]
    triads: tuple[TrueTriad, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Vertebrae with a triad, by increasing coordinate along the spine axis."""
        return tuple(triad.vertebra for triad in self.triads)


@dataclass(frozen=True, eq=False)
class TrueMotion:
    """Motion since PRE in the frame of the reference triad: rotation, displacement of P in mm."""

    rotation: Float
    translation_mm: Float


@dataclass(frozen=True, eq=False)
class Surgery:
    """The reference vertebra of a series of stages, and true motions by stage and vertebra."""

    reference: str
    motion: Mapping[str, Mapping[str, TrueMotion]]


def read_frames(folder: Path) -> tuple[Frame, Frame]:
    """Return the left and the right image of a scene."""
    left, right = (Frame(decode_image((folder / f"{side}.png").read_bytes()), side) for side in SIDES)
    return left, right


def find_scenes(root: Path) -> Iterator[Scene]:
    """Yield every scene with triads under ``root``, in the order of their folders."""
    for path in sorted(root.rglob("truth.json")):
        if {"calibration", "clean"} & set(path.relative_to(root).parts):
            continue
        truth = json.loads(path.read_text())
        if truth.get("triads"):
            yield _scene(path.parent, truth)


def read_surgery(folder: Path) -> Surgery | None:
    """Return the truth of the surgery whose stages lie in ``folder``; None if there is no surgery.json."""
    path = folder / "surgery.json"
    if not path.exists():
        return None
    document = json.loads(path.read_text())
    motion = {
        stage: {
            vertebra: TrueMotion(np.array(entry["R"]), np.array(entry["dP_mm"]))
            for vertebra, entry in vertebrae.items()
        }
        for stage, vertebrae in document["motion_from_PRE"].items()
    }
    return Surgery(document["reference_vertebra"], motion)


def _scene(folder: Path, truth: Mapping[str, Any]) -> Scene:
    by_name = {entry["vertebra"]: entry for entry in truth["triads"]}
    order = truth.get("labels_along_axis") or list(by_name)
    return Scene(
        folder=folder,
        rig=read_rig(folder, truth),
        exposure=truth.get("exposure_kind") or truth.get("imaging", {}).get("exposure_kind", ""),
        spine_axis=truth.get("spine_axis", "auto"),
        triads=tuple(_triad(by_name[name]) for name in order),
    )


def _triad(entry: Mapping[str, Any]) -> TrueTriad:
    balls = entry["balls"]
    return TrueTriad(
        vertebra=entry["vertebra"],
        position_mm=np.array(entry["P_mm"]),
        rotation=np.array(entry["R_object_from_triad"]),
        visible=entry["all_balls_visible_both_views"],
        centre_px={
            ball: {side: np.array(views[side]["center_px"]) for side in SIDES}
            for ball, views in balls.items()
        },
        visible_in={
            side: frozenset(ball for ball, views in balls.items() if views[side]["visible"]) for side in SIDES
        },
    )


def read_rig(folder: Path, truth: Mapping[str, Any]) -> Rig:
    """Return the rig of a scene from its truth, or else from the rig.json in the parent folder."""
    if "cameras" not in truth:
        return parse_rig((folder.parent / "rig.json").read_bytes())
    left, right = (_camera(truth["cameras"][side]) for side in SIDES)
    return rig_from_dict({"name": str(truth.get("rig_id", "rig")), "left": left, "right": right})


def _camera(entry: Mapping[str, Any]) -> dict[str, Any]:
    known, pixel = entry["thesis"], entry["pixel"]
    return {
        "position_mm": [known[f"{axis}0_mm"] for axis in "XYZ"],
        "rotation_deg": [known[f"{angle}_deg"] for angle in ("omega", "phi", "kappa")],
        "focal_length_mm": known["f_mm"],
        "principal_point_mm": [known["x0_mm"], known["y0_mm"]],
        "radial": [known["K1_per_mm2"], known.get("K2") or 0.0],
        "decentering": [known.get("P1") or 0.0, known.get("P2") or 0.0],
        "image_size_px": [pixel["width"], pixel["height"]],
        "pixel_size_mm": [pixel["px_mm"], pixel["py_mm"]],
    }
