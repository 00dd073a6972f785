"""Pictures of a peg board, drawn by ray casting: discs or crosses on white peg tops, as the calibration meets them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform


@dataclass(frozen=True)
class BoardLook:
    """What a board looks like: sizes in mm, gray levels 0 to 255, blur and noise in px and gray levels."""

    mark: Literal["disc", "cross"] = "disc"
    mark_mm: float = 10.0
    arm_mm: float = 2.5
    peg_mm: float = 19.0
    margin_mm: float = 20.0
    board: float = 110.0
    top: float = 240.0
    ink: float = 25.0
    side: float = 40.0
    blur_px: float = 0.55
    noise: float = 2.0
    samples: int = 4


def draw_board(
    camera: Camera,
    field: ControlField,
    placement: RigidTransform,
    rng: np.random.Generator,
    look: BoardLook | None = None,
) -> NDArray[np.uint8]:
    """Return the picture (H, W) that a camera takes of a board lying where ``placement`` says."""
    look = look or BoardLook()
    width, height = camera.image_size_px
    steps = (np.arange(look.samples) + 0.5) / look.samples - 0.5
    u = (np.arange(width)[:, None] + steps).ravel()
    v = (np.arange(height)[:, None] + steps).ravel()
    to_board = placement.inverse()
    eye = to_board(camera.centre[None])[0]
    rays = camera.directions(np.stack(np.meshgrid(u, v), axis=-1)) @ to_board.rotation.T
    shade = _plane(eye, rays, field, look)
    depth = np.full(shade.shape, np.inf)
    for point in field.points_mm:
        window = _window(camera, placement, point, look, shade.shape)
        if window is not None:
            _draw_peg(shade[window], depth[window], rays[window], eye, point, look)
    shade = shade.reshape(height, look.samples, width, look.samples).mean(axis=(1, 3))
    shade = np.asarray(cv2.GaussianBlur(shade, (0, 0), look.blur_px), dtype=np.float64)
    return np.clip(np.round(shade + look.noise * rng.standard_normal(shade.shape)), 0, 255).astype(np.uint8)


def _plane(eye: Float, rays: Float, field: ControlField, look: BoardLook) -> Float:
    hit = eye[:2] - eye[2] * rays[..., :2] / rays[..., 2:]
    low = field.points_mm[:, :2].min(axis=0) - look.margin_mm
    high = field.points_mm[:, :2].max(axis=0) + look.margin_mm
    on_board = np.all((hit > low) & (hit < high), axis=-1) & (rays[..., 2] < 0)
    return np.where(on_board, look.board, 4.0)


def _window(
    camera: Camera, placement: RigidTransform, point: Float, look: BoardLook, shape: tuple[int, ...]
) -> tuple[slice, slice] | None:
    r = look.peg_mm / 2
    corners = np.array(
        [[point[0] + a, point[1] + b, z] for a in (-r, r) for b in (-r, r) for z in (0.0, point[2])]
    )
    pixels = camera.project(placement(corners))
    if not np.all(np.isfinite(pixels)):
        return None
    low = np.clip(((pixels.min(axis=0) - 2) * look.samples).astype(int), 0, shape[::-1])
    high = np.clip(((pixels.max(axis=0) + 3) * look.samples).astype(int), 0, shape[::-1])
    return (slice(low[1], high[1]), slice(low[0], high[0])) if np.all(high > low) else None


def _draw_peg(shade: Float, depth: Float, rays: Float, eye: Float, point: Float, look: BoardLook) -> None:
    r = look.peg_mm / 2
    with np.errstate(all="ignore"):
        far = (point[2] - eye[2]) / rays[..., 2]
        offset = eye[:2] + far[..., None] * rays[..., :2] - point[:2]
        top = (np.hypot(offset[..., 0], offset[..., 1]) < r) & (far > 0) & (far < depth)
        shade[top] = np.where(_inked(offset, look), look.ink, look.top)[top]
        depth[top] = far[top]
        a = (rays[..., :2] ** 2).sum(axis=-1)
        b = ((eye[:2] - point[:2]) * rays[..., :2]).sum(axis=-1)
        c = ((eye[:2] - point[:2]) ** 2).sum() - r * r
        near = (-b - np.sqrt(b * b - a * c)) / a
        z = eye[2] + near * rays[..., 2]
        wall = np.isfinite(near) & (near > 0) & (z > 0) & (z < point[2]) & (near < depth)
    shade[wall] = look.side
    depth[wall] = near[wall]


def _inked(offset: Float, look: BoardLook) -> NDArray[np.bool_]:
    x, y = np.abs(offset[..., 0]), np.abs(offset[..., 1])
    if look.mark == "disc":
        return np.asarray(np.hypot(x, y) < look.mark_mm / 2)
    half, arm = look.mark_mm / 2, look.arm_mm / 2
    return np.asarray(((x < half) & (y < arm)) | ((y < half) & (x < arm)))
