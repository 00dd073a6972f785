"""Rendered images of chessboards and ChArUco boards."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Floating
from spinewatch.calibration.boards import BoardField, Charuco
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.geometry.transforms import RigidTransform

_SUPERSAMPLING = 4


def texture(field: BoardField, square_px: int) -> Floating:
    """Return the board from the front with a border of one square, gray levels."""
    board = field.board
    columns, rows = board.columns + 1, board.rows + 1
    if isinstance(board, Charuco):
        printed: Floating = np.asarray(
            cv2.aruco.CharucoBoard(
                (columns, rows),
                board.square_mm,
                board.marker_mm,
                cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)),
            ).generateImage((columns * square_px, rows * square_px)),
            dtype=np.float32,
        )
    else:
        printed = np.kron(np.indices((rows, columns)).sum(axis=0) % 2, np.full((square_px, square_px), 255.0))
    return np.asarray(30 + np.pad(printed.astype(np.float32), square_px, constant_values=255) * (200 / 255))


@cache
def directions(camera: Camera) -> Float:
    """Return the directions of several rays in every pixel."""
    steps = (np.arange(_SUPERSAMPLING) + 0.5) / _SUPERSAMPLING - 0.5
    u, v = ((np.arange(n)[:, None] + steps).ravel() for n in camera.image_size_px)
    return camera.directions(np.stack(np.meshgrid(u, v), axis=-1))


def render(
    camera: Camera,
    field: BoardField,
    placement: RigidTransform,
    rng: np.random.Generator,
    square_px: int = 120,
) -> NDArray[np.uint8]:
    """Return the image of a board, uint8, with noise of two gray levels."""
    board, front = field.board, texture(field, square_px)
    width, height = camera.image_size_px
    to_board = placement.inverse()
    eye = to_board(camera.centre[None])[0]
    rays = directions(camera) @ to_board.rotation.T
    hit = (eye[:2] - eye[2] * rays[..., :2] / rays[..., 2:] - field.points_mm[0, :2]) / board.square_mm
    at = ((hit * (1, -1) + 2) * square_px - 0.5).astype(np.float32)
    fine = cv2.remap(front, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=90)
    image = fine.reshape(height, _SUPERSAMPLING, width, _SUPERSAMPLING).mean(axis=(1, 3))
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.55))
    return np.clip(np.round(image + 2 * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)


def placement(
    field: BoardField,
    angles_deg: tuple[float, float, float],
    centre_mm: tuple[float, float, float] = (432.0, 384.0, 30.0),
) -> RigidTransform:
    """Return the motion that puts the middle of a board in view of the simulated rig, rotated."""
    R = rotation_from_angles(*angles_deg)
    return RigidTransform(R, np.array(centre_mm) - R @ field.points_mm.mean(axis=0))
