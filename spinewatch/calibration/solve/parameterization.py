"""The unknowns of a block as one vector, and the observation equations linearized in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.solve.block import MOTION_NAMES, Block, moved_placements
from spinewatch.calibration.solve.collinearity import (
    EXTERIOR_NAMES,
    camera_from_vector,
    camera_vector,
    project_with_derivatives,
)
from spinewatch.calibration.solve.conditioning import conditioned, unconditioned
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import cross_matrix, left_jacobian

_N_MOTION = len(MOTION_NAMES)


@dataclass(frozen=True, eq=False)
class Parameterization:
    """The map between a block and the vector x of its unknowns.

    The vector holds the coordinates of the free parameters of each camera, then a rotation vector and a translation of
    each placement but the first, from where the block has it. Coordinates are conditioned when the exterior orientation
    of a camera is free, and are its parameters when a part of it is held.

    Attributes
    ----------
    block
        The block at which the map is defined.
    centroid_mm
        Centroid of the control points, shape (3,), object space, mm.
    coordinates
        Coordinates of each camera of the block, shape (14,).
    """

    block: Block
    centroid_mm: Float
    coordinates: tuple[Float, ...]

    @classmethod
    def of(cls, block: Block) -> Parameterization:
        """Return the parameterization of a block.

        Parameters
        ----------
        block
            The block.

        Returns
        -------
        Parameterization
            The map; ``unpack(pack())`` gives the block again.
        """
        images = [(s, image) for (_, s), image in block.images.items() if len(image)]
        centroid = np.mean([block.placements[s](i.control_mm).mean(axis=0) for s, i in images], axis=0)
        coordinates = [
            conditioned(camera_vector(camera), centroid) if _is_conditioned(free) else camera_vector(camera)
            for camera, free in zip(block.cameras, block.free, strict=True)
        ]
        return cls(block, centroid, tuple(coordinates))

    def pack(self) -> Float:
        """Return the unknowns of the block itself.

        Returns
        -------
        Float
            x, shape (u,).
        """
        free = [y[i] for y, i in zip(self.coordinates, self.block.free_indices, strict=True)]
        return np.concatenate([*free, np.zeros(_N_MOTION * (len(self.block.placements) - 1))])

    def unpack(self, x: Float) -> Block:
        """Return the block of unknowns.

        Parameters
        ----------
        x
            Unknowns, shape (u,).

        Returns
        -------
        Block
            The block with the cameras and placements of x.
        """
        cameras, _ = self.cameras(x)
        placements = moved_placements(self.block.placements, self.motions(x).ravel())
        return Block(cameras, placements, self.block.images, self.block.free)

    def cameras(self, x: Float) -> tuple[tuple[Camera, ...], Float]:
        """Return the cameras of unknowns, and how parameters depend on the unknowns.

        Parameters
        ----------
        x
            Unknowns, shape (u,).

        Returns
        -------
        cameras : tuple of Camera
            The cameras.
        jacobian : Float
            Derivatives of the unknowns of `Block.unknown_names` (mm, degrees) with respect to x, shape (u, u).
        """
        cameras, first, jacobian = [], 0, np.eye(len(x))
        for camera, coordinates, free, index in zip(
            self.block.cameras, self.coordinates, self.block.free, self.block.free_indices, strict=True
        ):
            here = slice(first, first + len(index))
            first = here.stop
            if not index:
                cameras.append(camera)
                continue
            vector = coordinates.copy()
            vector[index] = x[here]
            if _is_conditioned(free):
                focal = None if "f" in free else camera.focal_length_mm
                vector, J = unconditioned(vector, self.centroid_mm, focal)
                jacobian[here, here] = J[np.ix_(index, index)]
            cameras.append(camera_from_vector(vector, camera))
        return tuple(cameras), jacobian

    def motions(self, x: Float) -> Float:
        """Return the motions of the placements.

        Parameters
        ----------
        x
            Unknowns, shape (u,).

        Returns
        -------
        Float
            Rotation vector (radians) and translation (mm) of each placement but the first, shape (s - 1, 6).
        """
        return x[len(x) - _N_MOTION * (len(self.block.placements) - 1) :].reshape(-1, _N_MOTION)


@dataclass(frozen=True, eq=False)
class Linearization:
    """The observation equations of a block near one vector of unknowns.

    Attributes
    ----------
    residuals
        Computed less measured coordinates over their standard deviations, shape (m,); NaN out of view.
    jacobian
        Derivatives of the residuals with respect to the unknowns of `Block.unknown_names`, shape (m, u).
    unknowns_by_x
        Derivatives of those unknowns with respect to x, shape (u, u).
    """

    residuals: Float
    jacobian: Float
    unknowns_by_x: Float

    @property
    def jacobian_by_x(self) -> Float:
        """Derivatives of the residuals with respect to x, shape (m, u)."""
        return self.jacobian @ self.unknowns_by_x


def linearize(parameterization: Parameterization, x: Float) -> Linearization:
    """Return the weighted residuals and their derivatives.

    Parameters
    ----------
    parameterization
        Meaning of x.
    x
        Unknowns, shape (u,).

    Returns
    -------
    Linearization
        Residuals and Jacobian. An x far from any solution gives NaN, from which a solver steps back.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.calibration.solve.block import Block
    >>> from spinewatch.geometry.transforms import RigidTransform
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, X = table_3_3_rig().left, pegboard_1995().take(["9", "10", "15"])
    >>> image = ImagePoints.build(["9", "10", "15"], X, camera.project(X) + [0.5, 0.0])
    >>> block = Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (("f", "x0"),))
    >>> p = Parameterization.of(block)
    >>> linearize(p, p.pack()).residuals.round(6) + 0.0
    array([-0.5,  0. , -0.5,  0. , -0.5,  0. ])
    """
    block = parameterization.block
    with np.errstate(all="ignore"):
        cameras, unknowns_by_x = parameterization.cameras(x)
    motions = parameterization.motions(x)
    placements = moved_placements(block.placements, motions.ravel())
    residuals = np.full(block.n_observations, np.nan)
    J = np.zeros((len(residuals), len(x)))
    column = 0
    for c, (camera, free) in enumerate(zip(cameras, block.free_indices, strict=True)):
        columns = slice(column, column + len(free))
        column = columns.stop
        views = [view for view in block.observation_slices if view[0] == c]
        if not views:
            continue
        images = [block.images[view] for view in views]
        points = np.concatenate(
            [placements[s](i.control_mm) for (_, s), i in zip(views, images, strict=True)]
        )
        measured = np.concatenate([image.pixels for image in images])
        weight = 1 / np.concatenate([image.sd_px for image in images])
        with np.errstate(all="ignore"):
            pixels, by_parameter, by_point = project_with_derivatives(camera, points, measured)
        weighted = (pixels - measured) * weight[:, None]
        by_parameter = by_parameter[:, :, free] * weight[:, None, None]
        by_point = by_point * weight[:, None, None]
        done = 0
        for view, image in zip(views, images, strict=True):
            at, here = block.observation_slices[view], slice(done, done + len(image))
            done = here.stop
            residuals[at] = weighted[here].ravel()
            J[at, columns] = by_parameter[here].reshape(-1, len(free)) if free else 0.0
            if (s := view[1]) > 0:
                from_origin = points[here] - placements[s].translation_mm
                by_rotation = by_point[here] @ -cross_matrix(from_origin) @ left_jacobian(motions[s - 1, :3])
                first = len(x) - motions.size + _N_MOTION * (s - 1)
                J[at, first : first + _N_MOTION] = np.concatenate(
                    [by_rotation, by_point[here]], axis=2
                ).reshape(-1, _N_MOTION)
    return Linearization(residuals, J, unknowns_by_x)


def _is_conditioned(free: tuple[str, ...]) -> bool:
    return set(EXTERIOR_NAMES) <= set(free)
