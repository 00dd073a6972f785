"""Where a board lies: rigid motions between the frame of a board and object space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.camera import Float


@dataclass(frozen=True, eq=False)
class Placement:
    """A rigid motion ``X_object = R X_board + t``: ``rotation`` (3, 3) and ``translation_mm`` (3,)."""

    rotation: Float
    translation_mm: Float

    @classmethod
    def identity(cls) -> Placement:
        """Return the placement that defines object space."""
        return cls(np.eye(3), np.zeros(3))

    def __call__(self, points_mm: Float) -> Float:
        """Return board points (n, 3) in object space."""
        return np.asarray(points_mm @ self.rotation.T + self.translation_mm)

    def inverse(self) -> Placement:
        """Return the motion from object space to the board."""
        return Placement(self.rotation.T, -self.rotation.T @ self.translation_mm)

    def after(self, first: Placement) -> Placement:
        """Return the motion that does ``first`` and then this."""
        return Placement(self.rotation @ first.rotation, self(first.translation_mm[None])[0])


def absolute_orientation(source_mm: Float, target_mm: Float) -> Placement:
    """Return the rigid motion that brings points (n, 3) nearest to others (n, 3), by Kabsch's method."""
    a, b = source_mm.mean(axis=0), target_mm.mean(axis=0)
    U, _, Vt = np.linalg.svd((target_mm - b).T @ (source_mm - a))
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    return Placement(R, b - R @ a)


def cross_matrices(v: Float) -> Float:
    """Return the matrices (..., 3, 3) with which vectors (..., 3) multiply from the left."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def turn(vector: Float) -> tuple[Float, Float]:
    """Return the rotation (3, 3) of a rotation vector (3,), radians, and its left Jacobian (3, 3).

    A small change d of the vector turns the result by ``jacobian @ d``.
    """
    angle = float(np.linalg.norm(vector))
    K = cross_matrices(vector)
    if angle < 1e-6:
        return np.eye(3) + K + K @ K / 2, np.eye(3) + K / 2 + K @ K / 6
    s, c = np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2
    return np.eye(3) + s * K + c * K @ K, np.eye(3) + c * K + (1 - s) / angle**2 * K @ K
