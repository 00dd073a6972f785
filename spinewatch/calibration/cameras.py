"""Any number of cameras from coordinates of one control field: resection of each, then one adjustment of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinewatch.calibration.errors import TooFewPointsError
from spinewatch.calibration.points import ImagePoints, Sensor, Shot, refuse_contradictions
from spinewatch.calibration.quality.accuracy import ShotAccuracy, shot_accuracy
from spinewatch.calibration.solve.blunders import adjust_without_blunders
from spinewatch.calibration.solve.bundle import Block, BundleAdjustment, ImageIndex
from spinewatch.calibration.solve.resection import SolveParameters, resect
from spinewatch.calibration.stereo import FOR_EXTERIOR, RemovedPoint, calibration_flags
from spinewatch.camera import Camera, Rig
from spinewatch.flags import Flag
from spinewatch.geometry.transforms import RigidTransform

Images = Mapping[str, ImagePoints]
"""What one camera sees, by shot."""


@dataclass(frozen=True, eq=False)
class CalibratedCameras:
    """Cameras in the object space that the first shot defines, by name, and how well they are known.

    ``adjustment`` numbers cameras and placements in the order of ``cameras`` and ``shots``; ``pairs`` holds the
    residuals of control points reconstructed by every two cameras; ``removed`` the blunders, whose ``side`` is
    the camera's name.
    """

    cameras: Mapping[str, Camera]
    shots: tuple[str, ...]
    adjustment: BundleAdjustment
    removed: tuple[RemovedPoint, ...]
    pairs: Mapping[tuple[str, str], tuple[ShotAccuracy, ...]]
    flags: tuple[Flag, ...]

    def sd(self, name: str) -> dict[str, float]:
        """Return the standard deviation of each adjusted parameter of a camera, mm and degrees."""
        prefix = f"{list(self.cameras).index(name)}:"
        return {n.removeprefix(prefix): v for n, v in self.adjustment.sd.items() if n.startswith(prefix)}


def calibrate_cameras(
    seen: Mapping[str, Images], sensor: Sensor, parameters: SolveParameters | None = None
) -> CalibratedCameras:
    """Return the cameras that see the images, by name, of one control field; all have the same sensor.

    Shots of the same name are the same placement of the field. The first shot of the first camera defines object
    space, and every camera must see it. With one shot this is a space resection of each camera; with several,
    the placements tie the cameras together. Orientation is not judged: cameras may stand on any side.

    Raises ``TooFewPointsError`` and ``PointsError``, and what ``resect`` raises, naming the camera.
    """
    parameters = parameters or SolveParameters()
    shots = tuple(dict.fromkeys(shot for images in seen.values() for shot in images))
    _refuse_unseen(seen, shots)
    usable = {name: [_usable(images.get(shot)) for shot in shots] for name, images in seen.items()}
    alone = [resect(images, sensor, parameters, f"camera {name}") for name, images in usable.items()]
    views: dict[ImageIndex, ImagePoints] = {
        (c, s): image
        for c, images in enumerate(usable.values())
        for s, image in enumerate(images)
        if image is not None
    }
    placements: list[RigidTransform] = []
    for s, shot in enumerate(shots):
        first = next((c for c in range(len(alone)) if (c, s) in views), None)
        if first is None:
            raise TooFewPointsError(
                f"no camera sees {FOR_EXTERIOR} points of shot {shot}; leave the shot out"
            )
        placements.append(alone[first].placements[s])
    block = Block(tuple(r.camera for r in alone), tuple(placements), views, tuple(r.free for r in alone))
    adjustment, blunders = adjust_without_blunders(block, parameters.blunders)
    names = tuple(seen)
    cameras = dict(zip(names, adjustment.block.cameras, strict=True))
    removed = tuple(RemovedPoint(names[b.camera], shots[b.placement], b.id, b.miss_px) for b in blunders)
    flags = calibration_flags(adjustment, dict(zip(names, adjustment.block.free, strict=True)), removed)
    return CalibratedCameras(cameras, shots, adjustment, removed, _pairs(cameras, shots, adjustment), flags)


def _usable(image: ImagePoints | None) -> ImagePoints | None:
    return image if image is not None and len(image) >= FOR_EXTERIOR else None


def _refuse_unseen(seen: Mapping[str, Images], shots: Sequence[str]) -> None:
    if not shots:
        raise TooFewPointsError(
            "no image point was given; give at least 6 of a control field for each camera"
        )
    for name, images in seen.items():
        count = len(images.get(shots[0], ()))
        if count < FOR_EXTERIOR:
            raise TooFewPointsError(
                f"camera {name} has {count} points of shot {shots[0]}; this shot defines object space, and every"
                " camera must see at least 6 points of it"
            )
    refuse_contradictions((name, image) for name, images in seen.items() for image in images.values())


def _pairs(
    cameras: Mapping[str, Camera], shots: Sequence[str], adjustment: BundleAdjustment
) -> dict[tuple[str, str], tuple[ShotAccuracy, ...]]:
    """Return the reconstruction of the points that two cameras both see, by pair; pairs without such are left out."""
    images = adjustment.block.images
    out = {}
    for (a, left), (b, right) in combinations(enumerate(cameras), 2):
        found = [
            shot_accuracy(
                Rig(f"{left}, {right}", cameras[left], cameras[right]),
                Shot(shot, images[a, s], images[b, s]),
                used=True,
                defines_object_space=s == 0,
            )
            for s, shot in enumerate(shots)
            if (a, s) in images and (b, s) in images
        ]
        if kept := tuple(f for f in found if np.all(np.isfinite(f.residuals_mm)) and len(f.ids) > 1):
            out[left, right] = kept
    return out
