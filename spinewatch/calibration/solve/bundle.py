"""Bundle adjustment: all cameras and all placements of the board together, by least squares in the images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.solve.block import Block, ImageIndex
from spinewatch.calibration.solve.parameterization import Linearization, Parameterization, linearize
from spinewatch.calibration.solve.reduced_equations import Evaluation, minimize, reduced
from spinewatch.geometry.rotations import angles_from_rotation

_TOLERANCE = 1e-12
_MAX_EVALUATIONS = 200
_MAX_DENSE_OBSERVATIONS = 1000
_MIN_CURVATURE = 0.1  # of Cauchy's loss, which is concave in the residuals beyond its scale
_SINGULAR = 1e-12
_OUT_OF_VIEW = (
    "the adjustment leads to cameras that do not have the points in view; check that the control field is the one in"
    " the images, and that all points are named correctly"
)


@dataclass(frozen=True, eq=False)
class BundleAdjustment:
    """An adjusted block.

    Attributes
    ----------
    block
        The block with adjusted cameras and placements.
    residuals_px
        Measured less computed coordinates of each image, shape (n, 2), px.
    sigma0
        Standard deviation of unit weight; NaN without redundancy.
    cofactor
        Cofactor matrix of the unknowns, shape (u, u), in the order of `names`; NaN when they are not determined.
    jacobian
        Derivatives of the weighted residuals (computed less measured), shape (m, u).
    converged
        False when the adjustment was stopped by its limit of evaluations.
    """

    block: Block
    residuals_px: dict[ImageIndex, Float]
    sigma0: float
    cofactor: Float
    jacobian: Float
    converged: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, as in `Block.unknown_names`."""
        return self.block.unknown_names

    @property
    def is_determined(self) -> bool:
        """Whether the points determine all unknowns."""
        return bool(np.all(np.isfinite(self.cofactor)))

    @property
    def covariance(self) -> Float:
        """Covariance of the unknowns, shape (u, u), mm and degrees, rotations of placements radians."""
        return self.cofactor * self.sigma0**2

    @property
    def correlation(self) -> Float:
        """Correlation of the unknowns, shape (u, u)."""
        s = np.sqrt(np.diag(self.cofactor))
        return np.asarray(self.cofactor / np.outer(s, s))

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviation of each unknown by name."""
        with np.errstate(invalid="ignore"):
            return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def weighted_residuals(self) -> dict[ImageIndex, Float]:
        """Residuals of each image over the standard deviations of its points, shape (n, 2)."""
        return {view: r / self.block.images[view].sd_px[:, None] for view, r in self.residuals_px.items()}

    @property
    def rms_px(self) -> float:
        """Root mean square of all residuals, per coordinate, px."""
        return rms(np.concatenate([r.ravel() for r in self.residuals_px.values()]))

    def camera_rms_px(self, camera: int) -> float:
        """Return the root mean square of the residuals of one camera.

        Parameters
        ----------
        camera
            Index of the camera.

        Returns
        -------
        float
            RMS per coordinate, px; NaN without image points.
        """
        own = [r.ravel() for (c, _), r in self.residuals_px.items() if c == camera]
        return rms(np.concatenate(own)) if own else float("nan")

    def camera_sd(self, camera: int) -> dict[str, float]:
        """Return the standard deviations of the adjusted parameters of one camera.

        Parameters
        ----------
        camera
            Index of the camera.

        Returns
        -------
        dict of str to float
            Standard deviation by parameter, mm, degrees and 1/mm^k; NaN without redundancy.
        """
        prefix = f"{camera}:"
        return {n.removeprefix(prefix): v for n, v in self.sd.items() if n.startswith(prefix)}

    def hat_blocks(self) -> dict[ImageIndex, Float]:
        """Return the blocks of the hat matrix: the influence of each point on its own computed coordinates.

        Returns
        -------
        dict of ImageIndex to Float
            Blocks of each image, shape (n, 2, 2).
        """
        out = {}
        for view, at in self.block.observation_slices.items():
            A = self.jacobian[at].reshape(-1, 2, self.jacobian.shape[1])
            out[view] = A @ self.cofactor @ np.swapaxes(A, 1, 2)
        return out


def rms(values: Float) -> float:
    """Return the root mean square.

    Parameters
    ----------
    values
        Numbers of any shape.

    Returns
    -------
    float
        Root mean square; NaN of no numbers.

    Examples
    --------
    >>> import numpy as np
    >>> round(rms(np.array([3.0, 4.0])), 3)
    3.536
    """
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else float("nan")


def adjust(
    block: Block,
    robust_scale: float | None = None,
    tolerance: float = _TOLERANCE,
    max_evaluations: int = _MAX_EVALUATIONS,
) -> BundleAdjustment:
    """Return the block with free parameters and placements at the least sum of squared image residuals.

    Levenberg-Marquardt with an analytic Jacobian, in the coordinates of `Parameterization`.

    Parameters
    ----------
    block
        Initial values and observations.
    robust_scale
        Scale of Cauchy's loss: weighted residuals beyond it lose weight. None for plain least squares.
    tolerance
        Iteration ends when the sum of squares changes by less than this fraction.
    max_evaluations
        Limit of evaluations of the residuals.

    Returns
    -------
    BundleAdjustment
        The adjusted block with residuals and covariance.

    Raises
    ------
    ConvergenceError
        If a camera does not have all its points in view, initially or at the end.

    References
    ----------
    Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), section 4.4. Thesis eq. 3.4.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.geometry.transforms import RigidTransform
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> image = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    >>> wrong = replace(camera, focal_length_mm=1.02 * camera.focal_length_mm)
    >>> block = Block((wrong,), (RigidTransform.identity(),), {(0, 0): image}, (("f",),))
    >>> abs(adjust(block).block.cameras[0].focal_length_mm - camera.focal_length_mm) < 1e-9
    True
    """
    if not block.n_observations:
        raise ConvergenceError(_OUT_OF_VIEW)
    parameterization = Parameterization.of(block)
    solve = _minimized_reduced if block.n_observations > _MAX_DENSE_OBSERVATIONS else _minimized
    try:
        x, converged = solve(parameterization, robust_scale, tolerance, max_evaluations)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ConvergenceError(_OUT_OF_VIEW) from error
    if not np.all(np.isfinite(x)):
        raise ConvergenceError(_OUT_OF_VIEW)
    return _described(_with_common_angles(parameterization.unpack(x)), converged)


def _minimized(
    parameterization: Parameterization, robust_scale: float | None, tolerance: float, max_evaluations: int
) -> tuple[Float, bool]:
    """Return the unknowns of the least cost, and whether the iteration converged, by MINPACK or by dogbox."""
    at = _with_last_result(parameterization)

    def residuals(x: Float) -> Float:
        return at(x).residuals

    def jacobian(x: Float) -> Float:
        return at(x).jacobian_by_x

    solution = least_squares(
        residuals,
        parameterization.pack(),
        jacobian,
        method="lm" if robust_scale is None and parameterization.block.dof >= 0 else "dogbox",
        x_scale="jac",
        loss="linear" if robust_scale is None else "cauchy",
        f_scale=robust_scale or 1.0,
        xtol=tolerance,
        ftol=tolerance,
        gtol=_TOLERANCE,
        max_nfev=max_evaluations,
    )
    if not np.all(np.isfinite(solution.fun)):
        raise np.linalg.LinAlgError(_OUT_OF_VIEW)
    return np.asarray(solution.x), bool(solution.success)


def _minimized_reduced(
    parameterization: Parameterization, robust_scale: float | None, tolerance: float, max_evaluations: int
) -> tuple[Float, bool]:
    """Return the same as `_minimized`, in a time that grows with the number of images and not with its square."""
    block = parameterization.block

    def evaluate(x: Float) -> Evaluation:
        at = linearize(parameterization, x)
        r = at.residuals
        if robust_scale is None:
            by_jacobian = by_residual = np.ones(len(r))
            cost = float(r @ r)
        else:
            z = (r / robust_scale) ** 2
            cost = float(robust_scale**2 * np.log1p(z).sum())
            slope = 1 / (1 + z)
            by_jacobian = np.sqrt(slope * np.maximum((1 - z) * slope, _MIN_CURVATURE))
            by_residual = slope / by_jacobian

        def equations() -> tuple[Float, Float]:
            J, v = reduced(block, at.jacobian * by_jacobian[:, None], r * by_residual)
            return J @ at.unknowns_by_x, v

        return Evaluation(cost, equations)

    minimum = minimize(evaluate, parameterization.pack(), tolerance, max_evaluations)
    return minimum.x, minimum.converged


def _with_last_result(parameterization: Parameterization) -> Callable[[Float], Linearization]:
    """Return `linearize`, which least_squares calls twice with the same x, with its last result kept."""
    last: list[tuple[bytes, Linearization]] = []

    def at(x: Float) -> Linearization:
        key = x.tobytes()
        if not last or last[0][0] != key:
            last[:] = [(key, linearize(parameterization, x))]
        return last[0][1]

    return at


def _described(block: Block, converged: bool) -> BundleAdjustment:
    """Return the adjustment of a block that is at its least sum of squares."""
    parameterization = Parameterization.of(block)
    at = linearize(parameterization, parameterization.pack())
    residuals = {
        view: -(at.residuals[here].reshape(-1, 2) * block.images[view].sd_px[:, None])
        for view, here in block.observation_slices.items()
    }
    dof = block.dof
    sigma0 = float(np.sqrt(at.residuals @ at.residuals / dof)) if dof > 0 else float("nan")
    J = at.jacobian
    if len(J) > _MAX_DENSE_OBSERVATIONS and np.all(np.isfinite(J)):
        J, _ = reduced(block, J, at.residuals)
    return BundleAdjustment(block, residuals, sigma0, _cofactor(J), at.jacobian, converged)


def _with_common_angles(block: Block) -> Block:
    """Return the block with the same rotations in angles between -180 and 180 degrees, phi between -90 and 90.

    Omega + 180, 180 - phi, kappa + 180 is the same rotation, and iteration may end there.
    """
    cameras = tuple(
        replace(c, rotation_deg=angles_from_rotation(c.M))
        if abs(c.rotation_deg[1]) > 90 or max(map(abs, c.rotation_deg)) > 180
        else c
        for c in block.cameras
    )
    return replace(block, cameras=cameras)


def _cofactor(J: Float) -> Float:
    """Return (J^T J)^-1 of J (m, u), or NaN when the columns of J are not independent."""
    undefined = np.full((J.shape[1],) * 2, np.nan)
    scale = np.linalg.norm(J, axis=0)
    if not np.all(np.isfinite(J)) or np.any(scale == 0):
        return undefined
    R = np.linalg.qr(J / scale, mode="r")  # has the same singular values, and is small
    _, s, Vt = np.linalg.svd(R, full_matrices=False)
    if len(s) < J.shape[1] or s[-1] < _SINGULAR * s[0]:
        return undefined
    V = Vt.T / s
    return np.asarray((V @ V.T) / np.outer(scale, scale))
