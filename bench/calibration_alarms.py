"""``python -m bench.calibration_alarms``: how often sound calibrations are flagged as doubtful, in simulation."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from spinewatch.calibration.control_field import ControlField, pegboard_1995
from spinewatch.calibration.errors import CalibrationError
from spinewatch.calibration.from_images import calibrate_from_points
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import converging_rig, table_3_3_rig

CODES = ("pixel-size-doubtful", "calibration-poor", "shot-repeated")
NOISE_PX = (0.02, 0.3)
MIN_POINTS = 10


def sound_shots(field: ControlField, rng: np.random.Generator) -> tuple[list[Shot], tuple[Sensor, Sensor]]:
    """Return one to four shots of a board, each tilted and shifted, by a random rig with random noise."""
    wide = converging_rig(rng.uniform(250, 600), rng.uniform(14, 32), target_mm=(317.5, 254.0, 40.0))
    rig = wide if rng.random() < 0.5 else table_3_3_rig()
    sigma_px = float(np.exp(rng.uniform(*np.log(NOISE_PX))))
    centre = field.points_mm.mean(axis=0)
    shots = []
    for k in range(rng.integers(1, 5)):
        R = Rotation.from_rotvec(rng.normal(0, 4.0 if k else 0.0, 3), degrees=True).as_matrix()
        placement = RigidTransform(R, centre - R @ centre + rng.normal(0, 10.0 if k else 0.0, 3))
        left, right = (_image(camera, field, placement, sigma_px, rng) for camera in (rig.left, rig.right))
        if min(len(left), len(right)) >= MIN_POINTS:
            shots.append(Shot(str(k + 1), left, right))
    return shots, (Sensor.of_camera(rig.left), Sensor.of_camera(rig.right))


def _image(
    camera: Camera, field: ControlField, placement: RigidTransform, sigma_px: float, rng: np.random.Generator
) -> ImagePoints:
    pixels = camera.project(placement(field.points_mm))
    in_view = np.all((pixels > 8) & (pixels < np.array(camera.image_size_px) - 9), axis=1)
    ids = [id_ for id_, seen in zip(field.ids, in_view, strict=True) if seen]
    noise = sigma_px * rng.standard_normal((len(ids), 2))
    return ImagePoints.build(ids, field.points_mm[in_view], pixels[in_view] + noise)


def codes(n: int) -> Iterator[frozenset[str]]:
    """Yield the flags of n simulated calibrations, or the code of the error."""
    field, rng = pegboard_1995(), np.random.default_rng(7)
    done = 0
    while done < n:
        shots, sensors = sound_shots(field, rng)
        if shots:
            done += 1
            try:
                result = calibrate_from_points(shots, field, sensors)
            except CalibrationError as error:
                yield frozenset({error.code})
            else:
                yield frozenset(flag.code for flag in result.calibration.flags)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=300, help="number of calibrations")
    n: int = parser.parse_args(arguments).n
    counts = Counter(code for raised in codes(n) for code in raised)
    for code in sorted({*CODES, *counts}):
        sys.stdout.write(f"{code}: {counts[code]} of {n}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
