"""Bundle adjustment: all cameras and all placements of the board at once, by least squares in the images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.collinearity import (
    NAMES,
    camera_from_vector,
    camera_vector,
    project_with_derivatives,
)
from spinewatch.calibration.solve.conditioning import conditioned, unconditioned
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import (
    angles_from_rotation,
    cross_matrix,
    left_jacobian,
    rotation_from_vector,
)
from spinewatch.geometry.transforms import RigidTransform

_TOLERANCE = 1e-12
_MAX_EVALUATIONS = 200
_SINGULAR = 1e-12
_F = NAMES.index("f")
_OUT_OF_SIGHT = (
    "the adjustment comes to cameras that do not see the points; check that the control field is the one in the"
    " pictures, and that every point is named right"
)

ImageIndex = tuple[int, int]
"""Index of a camera and of a placement."""


@dataclass(frozen=True, eq=False)
class Block:
    """Several cameras, placements of the board, and what each camera sees in each placement.

    ``images`` maps (camera, placement) to image points. ``free`` names the parameters of each camera that are
    adjusted. The first placement holds still: it defines object space.
    """

    cameras: tuple[Camera, ...]
    placements: tuple[RigidTransform, ...]
    images: dict[ImageIndex, ImagePoints]
    free: tuple[tuple[str, ...], ...]

    @property
    def unknowns(self) -> int:
        """Number of parameters that are adjusted."""
        return sum(map(len, self.free)) + 6 * (len(self.placements) - 1)

    @property
    def observations(self) -> int:
        """Number of measured coordinates."""
        return 2 * sum(map(len, self.images.values()))

    @property
    def redundancy(self) -> int:
        """Observations less unknowns."""
        return self.observations - self.unknowns


@dataclass(frozen=True, eq=False)
class BundleAdjustment:
    """An adjusted block.

    ``residuals_px`` per view (n, 2), measured less computed; ``sigma0`` the standard deviation of unit weight,
    NaN without redundancy; ``cofactor`` (u, u) of the unknowns in the order of ``names``, NaN when they are not
    determined; ``jacobian`` (m, u) of the weighted residuals; ``rows`` where each view's points lie in it;
    ``converged`` unless it was stopped on the way.
    """

    block: Block
    names: tuple[str, ...]
    residuals_px: dict[ImageIndex, Float]
    sigma0: float
    cofactor: Float
    jacobian: Float
    rows: dict[ImageIndex, slice]
    converged: bool

    @property
    def covariance(self) -> Float:
        """Covariance (u, u) of the unknowns, mm and degrees."""
        return self.cofactor * self.sigma0**2

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviation of each unknown by name."""
        with np.errstate(invalid="ignore"):
            return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def rms_px(self) -> float:
        """Root mean square of all residuals, per coordinate, px."""
        return rms(np.concatenate([r.ravel() for r in self.residuals_px.values()]))

    def camera_rms_px(self, camera: int) -> float:
        """Root mean square of one camera's residuals, per coordinate, px."""
        mine = [r.ravel() for (c, _), r in self.residuals_px.items() if c == camera]
        return rms(np.concatenate(mine)) if mine else float("nan")


def rms(values: Float) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def adjust(
    block: Block,
    robust_px: float | None = None,
    tolerance: float = _TOLERANCE,
    evaluations: int = _MAX_EVALUATIONS,
) -> BundleAdjustment:
    """Return the block with all free parameters and placements at the least sum of squared image residuals.

    With ``robust_px``, weighted residuals beyond it lose weight (Cauchy's loss). Iteration ends when the sum
    changes by less than the fraction ``tolerance``, or after so many ``evaluations``. The Jacobian is analytic.

    Raises ``ConvergenceError`` when a camera does not see all its points at the start or at the end.
    """
    if not block.observations:
        raise ConvergenceError(_OUT_OF_SIGHT)
    equations = _Equations(block)
    try:
        solution = least_squares(
            equations.residuals,
            equations.start,
            equations.jacobian,
            method="lm" if robust_px is None and block.redundancy >= 0 else "dogbox",
            x_scale="jac",
            loss="linear" if robust_px is None else "cauchy",
            f_scale=robust_px or 1.0,
            xtol=tolerance,
            ftol=tolerance,
            gtol=_TOLERANCE,
            max_nfev=evaluations,
        )
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ConvergenceError(_OUT_OF_SIGHT) from error
    x = np.asarray(solution.x)
    if not np.all(np.isfinite(solution.fun)):
        raise ConvergenceError(_OUT_OF_SIGHT)
    adjusted = _with_common_angles(equations.block_at(x))
    equations = _Equations(adjusted)
    weighted, J = equations.residuals(equations.start), equations.plain_jacobian(equations.start)
    residuals = {
        view: -(weighted[rows].reshape(-1, 2) * block.images[view].sd_px[:, None])
        for view, rows in equations.rows.items()
    }
    freedom = block.redundancy
    sigma0 = float(np.sqrt(weighted @ weighted / freedom)) if freedom > 0 else float("nan")
    return BundleAdjustment(
        adjusted, equations.names, residuals, sigma0, _cofactor(J), J, equations.rows, bool(solution.success)
    )


def _with_common_angles(block: Block) -> Block:
    """Return the block with the same rotations in angles of which phi is at most 90 degrees either way.

    Omega + 180, 180 - phi, kappa + 180 is the same rotation, and iteration may end there.
    """
    cameras = tuple(
        replace(c, rotation_deg=angles_from_rotation(c.M)) if abs(c.rotation_deg[1]) > 90 else c
        for c in block.cameras
    )
    return replace(block, cameras=cameras)


class _Equations:
    """Weighted residuals and Jacobian of a block as functions of its conditioned unknowns."""

    def __init__(self, block: Block) -> None:
        self.block = block
        self.index = [np.array([NAMES.index(name) for name in free], dtype=np.intp) for free in block.free]
        images = [(placement, image) for (_, placement), image in block.images.items() if len(image)]
        self.centroid = np.mean([block.placements[s](i.control_mm).mean(axis=0) for s, i in images], axis=0)
        self.coordinates = [conditioned(camera_vector(camera), self.centroid) for camera in block.cameras]
        free = [y[i] for y, i in zip(self.coordinates, self.index, strict=True)]
        self.start = np.concatenate([*free, np.zeros(6 * (len(block.placements) - 1))])
        self.rows: dict[ImageIndex, slice] = {}
        first = 0
        for view in sorted(block.images):
            self.rows[view] = slice(first, first + 2 * len(block.images[view]))
            first = self.rows[view].stop
        self.count = first
        self.at: Float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        cameras = (f"{c}:{name}" for c, free in enumerate(self.block.free) for name in free)
        moves = (
            f"placement {s}:{name}"
            for s in range(1, len(self.block.placements))
            for name in ("rx", "ry", "rz", "tx", "ty", "tz")
        )
        return (*cameras, *moves)

    def residuals(self, x: Float) -> Float:
        self._evaluate(x)
        return self.value

    def jacobian(self, x: Float) -> Float:
        """Return the derivatives (m, u) by the conditioned unknowns."""
        self._evaluate(x)
        return self.slope @ self.chain

    def plain_jacobian(self, x: Float) -> Float:
        """Return the derivatives (m, u) by the unknowns in mm and degrees."""
        self._evaluate(x)
        return self.slope

    def block_at(self, x: Float) -> Block:
        cameras, _, moves = self._split(x)
        placed = [_move(p, m)[0] for p, m in zip(self.block.placements, moves, strict=True)]
        return Block(tuple(cameras), tuple(placed), self.block.images, self.block.free)

    def _split(self, x: Float) -> tuple[list[Camera], Float, Float]:
        """Return the cameras, the derivatives (u, u) of plain by conditioned unknowns, and the moves (s, 6)."""
        cameras, first, chain = [], 0, np.eye(len(x))
        for like, start, index in zip(self.block.cameras, self.coordinates, self.index, strict=True):
            here = slice(first, first + len(index))
            first = here.stop
            y = start.copy()
            y[index] = x[here]
            focal = None if _F in index or not len(index) else like.focal_length_mm
            vector, J = unconditioned(y, self.centroid, focal)
            chain[here, here] = J[np.ix_(index, index)]
            cameras.append(camera_from_vector(vector, like) if len(index) else like)
        return cameras, chain, np.vstack([np.zeros((1, 6)), x[first:].reshape(-1, 6)])

    def _evaluate(self, x: Float) -> None:
        if self.at is not None and np.array_equal(self.at, x):
            return
        with np.errstate(all="ignore"):  # a step too far gives NaN, which the solver steps back from
            cameras, self.chain, moves = self._split(x)
        value, J = np.full(self.count, np.nan), np.zeros((self.count, len(x)))
        moved = [_move(p, m) for p, m in zip(self.block.placements, moves, strict=True)]
        column = 0
        for c, (camera, index) in enumerate(zip(cameras, self.index, strict=True)):
            columns = slice(column, column + len(index))
            column = columns.stop
            self._evaluate_camera(c, camera, columns, moved, value, J)
        self.at, self.value, self.slope = x.copy(), value, J

    def _evaluate_camera(
        self,
        c: int,
        camera: Camera,
        columns: slice,
        moved: Sequence[tuple[RigidTransform, Float]],
        value: Float,
        J: Float,
    ) -> None:
        views = [view for view in self.rows if view[0] == c]
        if not views:
            return
        images = [self.block.images[view] for view in views]
        points = np.concatenate([moved[s][0](i.control_mm) for (_, s), i in zip(views, images, strict=True)])
        measured = np.concatenate([image.pixels for image in images])
        weight = 1 / np.concatenate([image.sd_px for image in images])
        with np.errstate(all="ignore"):
            pixels, by_camera, by_point = project_with_derivatives(camera, points, measured)
        miss = (pixels - measured) * weight[:, None]
        by_camera = by_camera[:, :, self.index[c]] * weight[:, None, None]
        by_point = by_point * weight[:, None, None]
        first_move = len(self.start) - 6 * (len(moved) - 1)
        done = 0
        for (_, s), rows in ((view, self.rows[view]) for view in views):
            here = slice(done, done + (rows.stop - rows.start) // 2)
            done = here.stop
            value[rows] = miss[here].ravel()
            J[rows, columns] = by_camera[here].reshape(-1, by_camera.shape[2])
            if s > 0:
                turned = points[here] - moved[s][0].translation_mm
                by_turn = by_point[here] @ -cross_matrix(turned) @ moved[s][1]
                at = first_move + 6 * (s - 1)
                J[rows, at : at + 6] = np.concatenate([by_turn, by_point[here]], axis=2).reshape(-1, 6)


def _move(placement: RigidTransform, move: Float) -> tuple[RigidTransform, Float]:
    """Return a placement turned about its own origin and shifted by a move (6,), and the turn's left Jacobian."""
    R = rotation_from_vector(move[:3])
    return RigidTransform(R @ placement.rotation, placement.translation_mm + move[3:]), left_jacobian(
        move[:3]
    )


def _cofactor(J: Float) -> Float:
    """Return (J^T J)^-1, or NaN when the columns of J are not independent."""
    scale = np.linalg.norm(J, axis=0)
    if not np.all(np.isfinite(J)) or np.any(scale == 0):
        return np.full((J.shape[1],) * 2, np.nan)
    R = np.linalg.qr(J / scale, mode="r")  # has the same singular values, and is small
    _, s, Vt = np.linalg.svd(R, full_matrices=False)
    if len(s) < J.shape[1] or s[-1] < _SINGULAR * s[0]:
        return np.full((J.shape[1],) * 2, np.nan)
    V = Vt.T / s
    return np.asarray((V @ V.T) / np.outer(scale, scale))


def hat_blocks(adjustment: BundleAdjustment) -> dict[ImageIndex, NDArray[np.float64]]:
    """Return per view the blocks (n, 2, 2) of the hat matrix: how far each point's residual is pulled by itself."""
    J = adjustment.jacobian
    out = {}
    for view, rows in adjustment.rows.items():
        A = J[rows].reshape(-1, 2, J.shape[1])
        out[view] = A @ adjustment.cofactor @ np.swapaxes(A, 1, 2)
    return out
