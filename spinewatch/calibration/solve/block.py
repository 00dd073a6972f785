"""A bundle block: several cameras, several placements of a control field, and their image points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_from_vector, camera_vector
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform

ImageIndex = tuple[int, int]
"""Index of a camera and of a placement."""

MOTION_NAMES = ("rx", "ry", "rz", "tx", "ty", "tz")
"""The unknowns of a placement: a rotation vector in radians and a translation in mm, from where it is."""


@dataclass(frozen=True, eq=False)
class Block:
    """Cameras, placements of the board, and the image points of each camera in each placement.

    Attributes
    ----------
    cameras
        The cameras.
    placements
        Motion from the board's frame to object space in each shot; the first is held and defines object space.
    images
        Image points by (camera, placement).
    free
        Names of the adjusted parameters of each camera, in the order of `PARAMETER_NAMES`.
    """

    cameras: tuple[Camera, ...]
    placements: tuple[RigidTransform, ...]
    images: dict[ImageIndex, ImagePoints]
    free: tuple[tuple[str, ...], ...]

    @property
    def n_unknowns(self) -> int:
        """Number of adjusted parameters."""
        return sum(map(len, self.free)) + len(MOTION_NAMES) * (len(self.placements) - 1)

    @property
    def n_observations(self) -> int:
        """Number of measured image coordinates."""
        return 2 * sum(map(len, self.images.values()))

    @property
    def dof(self) -> int:
        """Degrees of freedom (redundancy): observations less unknowns."""
        return self.n_observations - self.n_unknowns

    @property
    def unknown_names(self) -> tuple[str, ...]:
        """Names of the unknowns: ``0:f`` is f of the first camera, ``placement 1:rx`` a motion of the second shot."""
        cameras = (f"{c}:{name}" for c, free in enumerate(self.free) for name in free)
        motions = (f"placement {s}:{name}" for s in range(1, len(self.placements)) for name in MOTION_NAMES)
        return (*cameras, *motions)

    @cached_property
    def free_indices(self) -> tuple[list[int], ...]:
        """Indices of the adjusted parameters of each camera in `PARAMETER_NAMES`."""
        return tuple([PARAMETER_NAMES.index(name) for name in free] for free in self.free)

    @cached_property
    def observation_slices(self) -> dict[ImageIndex, slice]:
        """Range of each image's coordinates u0, v0, u1, ... among all observations."""
        slices, first = {}, 0
        for view in sorted(self.images):
            slices[view] = slice(first, first + 2 * len(self.images[view]))
            first = slices[view].stop
        return slices

    def changed(self, change: Float) -> Block:
        """Return the block after a change of its unknowns.

        Parameters
        ----------
        change
            Change of each unknown in the order of `unknown_names`, mm and degrees, rotations of placements radians.

        Returns
        -------
        Block
            The block with its changed cameras and placements.
        """
        cameras, first = [], 0
        for camera, free in zip(self.cameras, self.free_indices, strict=True):
            vector = camera_vector(camera)
            vector[free] += change[first : first + len(free)]
            first += len(free)
            cameras.append(camera_from_vector(vector, camera))
        return Block(
            tuple(cameras), moved_placements(self.placements, change[first:]), self.images, self.free
        )


def moved_placements(placements: Sequence[RigidTransform], motions: Float) -> tuple[RigidTransform, ...]:
    """Return placements after small motions: each rotated about its own origin, then shifted.

    Parameters
    ----------
    placements
        Motions from the board's frame to object space; the first is held.
    motions
        Rotation vector (radians) and translation (mm) of each placement but the first, shape (6 (n - 1),).

    Returns
    -------
    tuple of RigidTransform
        The n placements.
    """
    moved = [
        RigidTransform(rotation_from_vector(m[:3]) @ p.rotation, p.translation_mm + m[3:])
        for p, m in zip(placements[1:], np.reshape(motions, (-1, len(MOTION_NAMES))), strict=True)
    ]
    return (*placements[:1], *moved)
