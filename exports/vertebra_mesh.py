"""A low-polygon vertebra for drawing: body, arch, spinous and transverse processes, so that its orientation shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float

_SIDES = 16
_BACK_FLATTENED = 0.36
_WAIST = 0.9
_QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh of triangles.

    Attributes
    ----------
    positions
        Corners, shape (n, 3), in vertebra axes: x anterior, y left, z cephalad. Corners are not shared by faces that
        differ in direction, so that edges look sharp.
    normals
        Unit normals at the corners, shape (n, 3), outwards.
    triangles
        Indices of corners, shape (m, 3), counter-clockwise seen from outside.
    """

    positions: Float
    normals: Float
    triangles: NDArray[np.uint16]


@cache
def vertebra() -> Mesh:
    """Return a vertebra whose body has depth, width and height 1 and its centre at the origin.

    Returns
    -------
    Mesh
        Scaled by depth, width and height it becomes a vertebra; processes reach beyond the body to the back and sides.
    """
    parts = [_body()]
    for side in (-1.0, 1.0):
        parts.append(_box((-0.62, 0.26 * side, 0.18), (0.36, 0.12, 0.3)))  # pedicle
        parts.append(_box((-0.92, 0.2 * side, 0.05), (0.28, 0.34, 0.55)))  # lamina
        parts.append(_box((-0.86, 0.58 * side, 0.16), (0.2, 0.5, 0.22), (-0.14, 0.0, 0.0)))  # transverse
    parts.append(_box((-1.26, 0.0, -0.22), (0.6, 0.12, 0.42), (0.0, 0.0, -0.36)))  # spinous
    return _joined([_flat(triangles) for triangles in parts])


@cache
def arrow() -> Mesh:
    """Return an arrow of length 1 along z from the origin.

    Returns
    -------
    Mesh
        Shaft and head, each four-sided.
    """
    shaft = _prism(_ring(4, 0.02), 0.0, 0.8)
    base = np.column_stack([_ring(4, 0.06), np.full(4, 0.8)])
    tip = np.array([0.0, 0.0, 1.0])
    sides = [[base[i], base[(i + 1) % 4], tip] for i in range(4)]
    bottom = [[base[0], base[2], base[1]], [base[0], base[3], base[2]]]
    return _joined([_flat(shaft), _flat(np.array(sides + bottom))])


def _body() -> Float:
    """Return the triangles of the body: three rings, the middle one narrower, flattened at the back."""
    ring = _ring(_SIDES, 0.5)
    ring[:, 0] = np.maximum(ring[:, 0], -_BACK_FLATTENED)
    ring[:, 0] = (ring[:, 0] - ring[:, 0].min()) / np.ptp(ring[:, 0]) - 0.5
    middle = ring * _WAIST
    return np.concatenate([
        _wall(ring, -0.5, middle, 0.0), _wall(middle, 0.0, ring, 0.5), _cap(ring, 0.5), _cap(ring, -0.5)
    ])  # fmt: skip


def _ring(sides: int, radius: float) -> Float:
    angles = 2 * np.pi * np.arange(sides) / sides
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _prism(ring: Float, bottom: float, top: float) -> Float:
    return np.concatenate([_wall(ring, bottom, ring, top), _cap(ring, top), _cap(ring, bottom, facing=-1)])


def _wall(low: Float, bottom: float, high: Float, top: float) -> Float:
    a = np.column_stack([low, np.full(len(low), bottom)])
    b = np.column_stack([high, np.full(len(high), top)])
    a_next, b_next = np.roll(a, -1, axis=0), np.roll(b, -1, axis=0)
    return np.concatenate([np.stack([a, a_next, b_next], axis=1), np.stack([a, b_next, b], axis=1)])


def _cap(ring: Float, height: float, facing: int = 0) -> Float:
    corners = np.column_stack([ring, np.full(len(ring), height)])
    centre = np.broadcast_to(np.append(ring.mean(axis=0), height), corners.shape)
    triangles = np.stack([centre, corners, np.roll(corners, -1, axis=0)], axis=1)
    return triangles if (facing or height) > 0 else triangles[:, ::-1]


def _box(centre: Sequence[float], size: Sequence[float], shear: Sequence[float] = (0.0, 0.0, 0.0)) -> Float:
    """Return the triangles of a box whose far end (away from the body) is shifted."""
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    corners = np.asarray(centre) + signs * size
    far = signs[:, 0] < 0 if centre[1] == 0.0 else signs[:, 1] * centre[1] > 0
    corners[far] += shear
    quads = [corners[list(quad)] for quad in _QUADS]
    return np.array([quad[list(three)] for quad in quads for three in ((0, 1, 2), (0, 2, 3))])


def _flat(triangles: Float) -> tuple[Float, Float]:
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0)


def _joined(parts: Sequence[tuple[Float, Float]]) -> Mesh:
    positions = np.concatenate([part[0] for part in parts])
    normals = np.concatenate([part[1] for part in parts])
    corners = np.round(np.column_stack([positions, normals]), 6)
    unique, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1, 3).astype(np.uint16)
    assert len(unique) < 2**16  # noqa: S101 - the geometry is this module's own
    return Mesh(positions[first], normals[first], triangles)
