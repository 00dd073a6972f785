"""Simulated images of a peg board by ray casting: discs or crosses on white peg tops, on a darker board."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform


@dataclass(frozen=True)
class BoardStyle:
    """Sizes and gray levels of a peg board, and blur and noise of its image.

    Attributes
    ----------
    mark
        Shape of the marks on the peg tops.
    mark_mm
        Diameter of a disc or length of a cross, mm.
    arm_mm
        Width of the arms of a cross, mm.
    peg_mm
        Diameter of a peg, mm.
    margin_mm
        Distance from the outer pegs to the edge of the board, mm.
    board
        Gray level of the board, 0 to 255.
    top
        Gray level of the peg tops.
    ink
        Gray level of the marks.
    side
        Gray level of the walls of the pegs.
    blur_px
        Standard deviation of the blur, px.
    noise
        Standard deviation of the noise, gray levels.
    samples
        Rays per pixel and axis.
    """

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


def render_board(
    camera: Camera,
    field: ControlField,
    placement: RigidTransform,
    rng: np.random.Generator,
    style: BoardStyle | None = None,
) -> NDArray[np.uint8]:
    """Return the image of a peg board.

    Parameters
    ----------
    camera
        The camera.
    field
        The control points, in the middle of the peg tops; pegs rise from the plane z = 0 of the board.
    placement
        Rigid motion from the board to object space.
    rng
        Source of random numbers, for the noise.
    style
        Sizes, gray levels, blur and noise.

    Returns
    -------
    ndarray of uint8
        Gray levels, shape (H, W).

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera = table_3_3_rig().left
    >>> rng = np.random.default_rng(0)
    >>> render_board(camera, pegboard_1995(), RigidTransform.identity(), rng).shape
    (416, 568)
    """
    style = style or BoardStyle()
    width, height = camera.image_size_px
    steps = (np.arange(style.samples) + 0.5) / style.samples - 0.5
    u = (np.arange(width)[:, None] + steps).ravel()
    v = (np.arange(height)[:, None] + steps).ravel()
    to_board = placement.inverse()
    eye = to_board(camera.centre[None])[0]
    rays = camera.directions(np.stack(np.meshgrid(u, v), axis=-1)) @ to_board.rotation.T
    shade = _plane(eye, rays, field, style)
    depth = np.full(shade.shape, np.inf)
    for point in field.points_mm:
        window = _window(camera, placement, point, style, shade.shape)
        if window is not None:
            _draw_peg(shade[window], depth[window], rays[window], eye, point, style)
    shade = shade.reshape(height, style.samples, width, style.samples).mean(axis=(1, 3))
    shade = np.asarray(cv2.GaussianBlur(shade, (0, 0), style.blur_px), dtype=np.float64)
    return np.clip(np.round(shade + style.noise * rng.standard_normal(shade.shape)), 0, 255).astype(np.uint8)


def _plane(eye: Float, rays: Float, field: ControlField, style: BoardStyle) -> Float:
    """Return the gray levels (h, w) of the board without pegs along rays (h, w, 3) from the camera ``eye`` (3,)."""
    hit = eye[:2] - eye[2] * rays[..., :2] / rays[..., 2:]
    low = field.points_mm[:, :2].min(axis=0) - style.margin_mm
    high = field.points_mm[:, :2].max(axis=0) + style.margin_mm
    on_board = np.all((hit > low) & (hit < high), axis=-1) & (rays[..., 2] < 0)
    return np.where(on_board, style.board, 4.0)


def _window(
    camera: Camera, placement: RigidTransform, point: Float, style: BoardStyle, shape: tuple[int, ...]
) -> tuple[slice, slice] | None:
    """Return the part of the sampled image that contains a peg, or None outside the image."""
    r = style.peg_mm / 2
    corners = np.array(
        [[point[0] + a, point[1] + b, z] for a in (-r, r) for b in (-r, r) for z in (0.0, point[2])]
    )
    pixels = camera.project(placement(corners))
    if not np.all(np.isfinite(pixels)):
        return None
    low = np.clip(((pixels.min(axis=0) - 2) * style.samples).astype(int), 0, shape[::-1])
    high = np.clip(((pixels.max(axis=0) + 3) * style.samples).astype(int), 0, shape[::-1])
    return (slice(low[1], high[1]), slice(low[0], high[0])) if np.all(high > low) else None


def _draw_peg(shade: Float, depth: Float, rays: Float, eye: Float, point: Float, style: BoardStyle) -> None:
    """Draw a peg into gray levels (h, w) where it is nearer to the camera than ``depth`` (h, w), which it updates."""
    r = style.peg_mm / 2
    with np.errstate(all="ignore"):
        far = (point[2] - eye[2]) / rays[..., 2]
        offset = eye[:2] + far[..., None] * rays[..., :2] - point[:2]
        top = (np.hypot(offset[..., 0], offset[..., 1]) < r) & (far > 0) & (far < depth)
        shade[top] = np.where(_inked(offset, style), style.ink, style.top)[top]
        depth[top] = far[top]
        a = (rays[..., :2] ** 2).sum(axis=-1)
        b = ((eye[:2] - point[:2]) * rays[..., :2]).sum(axis=-1)
        c = ((eye[:2] - point[:2]) ** 2).sum() - r * r
        near = (-b - np.sqrt(b * b - a * c)) / a
        z = eye[2] + near * rays[..., 2]
        wall = np.isfinite(near) & (near > 0) & (z > 0) & (z < point[2]) & (near < depth)
    shade[wall] = style.side
    depth[wall] = near[wall]


def _inked(offset: Float, style: BoardStyle) -> Bool:
    """Return (...,) whether points at offsets (..., 2) from the middle of a peg top lie on its mark."""
    x, y = np.abs(offset[..., 0]), np.abs(offset[..., 1])
    if style.mark == "disc":
        return np.asarray(np.hypot(x, y) < style.mark_mm / 2)
    half, arm = style.mark_mm / 2, style.arm_mm / 2
    return np.asarray(((x < half) & (y < arm)) | ((y < half) & (x < arm)))
