"""Simulated image points and images of the 1995 board, for the tests of calibration."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import converging_rig, table_3_3_rig

FIELD = pegboard_1995()
TYPICAL = tuple(str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18))
"""The points that both cameras of Table 3.3 have in view."""

SENSOR = Sensor((568, 416), (0.01, 0.00845))
SENSORS = (SENSOR, SENSOR)
TABLE_3_3 = table_3_3_rig()
WIDE = converging_rig(500.0, 24.0, target_mm=(317.5, 254.0, 40.0))
"""A rig that has all 30 points in view."""

WIDE_SENSOR = Sensor.of_camera(WIDE.left)
IDENTITY = RigidTransform.identity()


def moved_board(seed: int, tilt_deg: float = 4.0, shift_mm: float = 10.0) -> RigidTransform:
    """A random small motion of the board about its centre."""
    rng = np.random.default_rng(seed)
    centre = FIELD.points_mm.mean(axis=0)
    R = Rotation.from_rotvec(rng.normal(0, tilt_deg, 3), degrees=True).as_matrix()
    return RigidTransform(R, centre - R @ centre + rng.normal(0, shift_mm, 3))


def image(
    camera: Camera,
    ids: Sequence[str] = TYPICAL,
    placement: RigidTransform = IDENTITY,
    sigma_px: float = 0.0,
    seed: int = 0,
    offsets_px: Float | float = 0.0,
) -> ImagePoints:
    """Image points of some pegs, with noise and offsets."""
    control = FIELD.take(ids)
    noise = sigma_px * np.random.default_rng(seed).standard_normal((len(ids), 2))
    return ImagePoints.build(ids, control, camera.project(placement(control)) + noise + offsets_px)


def stereo_shot(
    name: str = "C",
    ids: Sequence[str] = TYPICAL,
    placement: RigidTransform = IDENTITY,
    sigma_px: float = 0.0,
    seed: int = 0,
) -> Shot:
    """A shot of some pegs by the rig of Table 3.3."""
    left, right = (
        image(camera, ids, placement, sigma_px, 2 * seed + side)
        for side, camera in enumerate((TABLE_3_3.left, TABLE_3_3.right))
    )
    return Shot(name, left, right)


def one_camera(camera: Camera, points: ImagePoints, free: Sequence[str]) -> Block:
    """A block of one camera and one shot."""
    return Block((camera,), (IDENTITY,), {(0, 0): points}, (tuple(free),))


def parameter_error(camera: Camera, true: Camera) -> float:
    """The largest difference of the parameters of two cameras."""
    return float(np.abs(camera_vector(camera) - camera_vector(true)).max())
