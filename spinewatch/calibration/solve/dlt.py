"""Direct linear transformation with radial distortion (eq. 3.1): a camera without initial values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.calibration.errors import (
    ConvergenceError,
    MirroredFieldError,
    PlanarFieldError,
    TooFewPointsError,
)
from spinewatch.calibration.points import ImagePoints, Sensor, flatness
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import angles_from_rotation, nearest_rotation

MIN_DLT_POINTS = 6
"""Points that determine the eleven constants and K1."""

_MAX_ITERATIONS = 20
_TOLERANCE = 1e-8
_EXACT_MM = 1e-6


@dataclass(frozen=True)
class DltParameters:
    """How the direct linear transformation is solved.

    Attributes
    ----------
    min_flatness
        Smallest over middle principal extent of control points below which they count as planar: 0.02 is 3 mm of
        relief on a board of 150 mm.
    cauchy_scale
        Residual at which a point loses half of its squared weight, in medians of the residuals.
    outlier_factor
        Residual from which a point is an outlier, in medians of the residuals.
    n_samples
        Number of random samples of the least median of squares, when there are outliers.
    sample_size
        Points per sample.
    """

    min_flatness: float = 0.02
    cauchy_scale: float = 2.0
    outlier_factor: float = 6.0
    n_samples: int = 100
    sample_size: int = 8


@dataclass(frozen=True, eq=False)
class DltSolution:
    """A solved direct linear transformation.

    Attributes
    ----------
    L
        The eleven constants and 1, shape (3, 4).
    K1
        Radial distortion, per mm^2.
    camera
        The camera that these describe, with the sensor's aspect.
    aspect
        py/px as the image shows it (eq. 3.5).
    """

    L: Float
    K1: float
    camera: Camera
    aspect: float


def check_solvable(points: ImagePoints, where: str, parameters: DltParameters | None = None) -> None:
    """Check that a camera can be solved from a single image.

    Parameters
    ----------
    points
        Its image points.
    where
        Name of the image in error messages.
    parameters
        Limit of flatness.

    Raises
    ------
    TooFewPointsError
        If there are fewer than `MIN_DLT_POINTS`.
    PlanarFieldError
        If the control points lie nearly in a plane.
    """
    parameters = parameters or DltParameters()
    if len(points) < MIN_DLT_POINTS:
        raise TooFewPointsError(
            f"{where} has {len(points)} control points; at least {MIN_DLT_POINTS} that are well spread are needed"
        )
    if flatness(points.control_mm) < parameters.min_flatness:
        raise PlanarFieldError(
            f"the control points of {where} lie in one plane or nearly so; use a field with pegs of different"
            " heights, or give several shots of the plane, tilted differently"
        )


def solve_dlt(
    points: ImagePoints, sensor: Sensor, where: str = "the image", parameters: DltParameters | None = None
) -> DltSolution:
    """Return the direct linear transformation with K1.

    With ``A = L9 X + L10 Y + L11 Z + 1``, eq. 3.1 is ``(x + (x - x0) K1 r^2) A = L1 X + ...``: linear in L and K1
    when A, r and the principal point are taken from the previous iteration. Equations are divided by the previous A,
    so that residuals are measured on the plate.

    Parameters
    ----------
    points
        At least `MIN_DLT_POINTS` image points.
    sensor
        The sensor.
    where
        Name of the image in error messages.
    parameters
        Weights and outliers.

    Returns
    -------
    DltSolution
        The iteration of the least median residual.

    Raises
    ------
    TooFewPointsError, PlanarFieldError
        If the points do not determine a camera.
    MirroredFieldError
        If only a mirrored camera fits.
    ConvergenceError
        If the points determine no projection.

    References
    ----------
    Thesis eq. 3.1; here r is measured from the principal point. Y. I. Abdel-Aziz, H. M. Karara, ASP Symposium on
    Close-Range Photogrammetry (1971) 1-18. Least median of squares: P. J. Rousseeuw, J. Am. Stat. Assoc. 79 (1984) 871.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> points = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    >>> round(solve_dlt(points, Sensor.of_camera(camera)).aspect, 4)
    0.845
    """
    parameters = parameters or DltParameters()
    check_solvable(points, where, parameters)
    solved = _best_iteration(points, sensor, where, parameters)
    if len(points) > 2 * MIN_DLT_POINTS and (
        solved is None or _has_outliers(_residuals_px(solved, points), parameters)
    ):
        inliers = points.keep(_inliers(points, sensor, parameters))
        solved = _best_iteration(inliers, sensor, where, parameters) or solved
    if solved is None:
        raise MirroredFieldError(
            f"{where} shows the control field mirrored: its coordinates must be right-handed, Z up to the"
            " cameras, and pixels count to the right and down; look for a reversed sign, or X and Y exchanged"
        )
    return solved


def _best_iteration(
    points: ImagePoints, sensor: Sensor, where: str, parameters: DltParameters
) -> DltSolution | None:
    """Return the iteration of the least median residual, or None when all describe a mirrored camera."""
    xy = sensor.camera().plate(points.pixels)
    T, X = _normalized(points.control_mm)
    best, min_median, iterations = None, np.inf, 0
    for L, K1 in _iterate(xy, X, sensor.plate_mm / 2, parameters):
        iterations += 1
        solved = _decompose(L @ T, K1, points, sensor)
        if solved is None:
            continue
        median = float(np.median(_residuals_px(solved, points)))
        if best is None or median < min_median:
            best, min_median = solved, median
    if not iterations:
        raise ConvergenceError(
            f"the points of {where} do not determine a projection; spread them over the image"
        )
    return best


def _residuals_px(solved: DltSolution, points: ImagePoints) -> Float:
    """Return the lengths (n,) of the residuals, infinite out of view."""
    with np.errstate(all="ignore"):
        d = solved.camera.project(points.control_mm) - points.pixels
    return np.nan_to_num(np.hypot(d[:, 0], d[:, 1]), nan=np.inf)


def _has_outliers(residuals_px: Float, parameters: DltParameters) -> bool:
    return float(residuals_px.max()) > parameters.outlier_factor * float(np.median(residuals_px))


def _inliers(points: ImagePoints, sensor: Sensor, parameters: DltParameters) -> Bool:
    """Return the points (n,) near the projection of least median residual among random samples, without distortion."""
    xy = sensor.camera().plate(points.pixels)
    _, X = _normalized(points.control_mm)
    rng = np.random.default_rng(0)  # the same samples for the same points
    best, min_median = np.ones(len(X), dtype=bool), np.inf
    for _ in range(parameters.n_samples):
        sample = rng.choice(len(X), parameters.sample_size, replace=False)
        zero = np.zeros_like(X[sample])
        B = np.vstack([np.hstack([X[sample], zero]), np.hstack([zero, X[sample]])])
        B = np.hstack([B, -xy[sample].T.ravel()[:, None] * np.tile(X[sample][:, :3], (2, 1))])
        L = np.append(np.linalg.lstsq(B, xy[sample].T.ravel(), rcond=None)[0], 1.0).reshape(3, 4)
        image = X @ L.T
        with np.errstate(all="ignore"):
            residual = np.hypot(*(image[:, :2] / image[:, 2:] - xy).T)
        median = float(np.median(residual))
        if median < min_median:
            best, min_median = residual < parameters.outlier_factor * median, median
    return best


def _iterate(
    xy: Float, X: Float, half_plate: Float, parameters: DltParameters
) -> Iterator[tuple[Float, float]]:
    """Yield L (3, 4) and K1: first without distortion, then after each iteration until they converge."""
    principal, A, weight = np.zeros(2), np.ones(len(X)), np.ones(len(X))
    L = np.zeros((3, 4))
    for iteration in range(_MAX_ITERATIONS):
        previous = L
        L, K1, weight = _solve_linear(xy, X, weight / A, A, principal, parameters, distortion=iteration > 0)
        A = X @ L[2]
        if not np.all(np.isfinite(L)) or np.ptp(np.sign(A)) > 0:
            return
        yield L, K1
        principal = np.clip(_principal_point(L), -half_plate, half_plate)
        if np.abs(L - previous).max() < _TOLERANCE * np.abs(L).max():
            return


def _solve_linear(
    xy: Float,
    X: Float,
    weight: Float,
    A: Float,
    principal: Float,
    parameters: DltParameters,
    *,
    distortion: bool,
) -> tuple[Float, float, Float]:
    """Return L (3, 4), K1 and the weights (n,) of Cauchy's loss for the next iteration."""
    d = xy - principal
    r2 = (d * d).sum(axis=1)
    zero = np.zeros_like(X)
    equations = []
    for axis in range(2):
        numerator = (X, zero) if axis == 0 else (zero, X)
        radial = (-(d[:, axis] * r2 * A)[:, None],) if distortion else ()
        equations.append(np.hstack([*numerator, -xy[:, axis, None] * X[:, :3], *radial]))
    B, b, w = np.vstack(equations), xy.T.ravel(), np.tile(weight, 2)[:, None]
    scale = np.linalg.norm(w * B, axis=0)
    solution = np.linalg.lstsq(w * B / scale, w[:, 0] * b, rcond=None)[0] / scale
    L = np.append(solution[:11], 1.0).reshape(3, 4)
    residual = np.hypot(*((B @ solution - b).reshape(2, -1) / (X @ L[2])))
    half_weight = max(parameters.cauchy_scale * float(np.median(residual)), _EXACT_MM)
    K1 = float(solution[11]) if distortion else 0.0
    return L, K1, 1 / np.sqrt(1 + (residual / half_weight) ** 2)


def _normalized(points_mm: Float) -> tuple[Float, Float]:
    """Return T (4, 4) and homogeneous points (n, 4) with T points: centred, of largest coordinate 1."""
    centre = points_mm.mean(axis=0)
    scale = np.abs(points_mm - centre).max()
    T = np.diag([1 / scale] * 3 + [1.0])
    T[:3, 3] = -centre / scale
    return T, np.column_stack([(points_mm - centre) / scale, np.ones(len(points_mm))])


def _principal_point(L: Float) -> Float:
    m1, m2, m3 = L[:, :3]
    return np.asarray(np.array([m1 @ m3, m2 @ m3]) / (m3 @ m3))


def _decompose(P: Float, K1: float, points: ImagePoints, sensor: Sensor) -> DltSolution | None:
    """Return the camera of P (3, 4) ~ K M [1 | -X0], K = [[-fx, s, x0], [0, -fy, y0], [0, 0, 1]].

    None when only a mirrored camera fits.
    """
    depth = np.column_stack([points.control_mm, np.ones(len(points))]) @ P[2]
    P = P / np.linalg.norm(P[2, :3]) * -np.sign(np.median(depth))  # points in view have Xc[2] < 0
    # det K > 0, since -f stands in both of its first rows: P is right-handed.
    if np.linalg.det(P[:, :3]) < 0:
        return None
    m1, m2, m3 = P[:, :3]
    x0, y0 = m1 @ m3, m2 @ m3
    a, b = -(m1 - x0 * m3), -(m2 - y0 * m3)
    fx, fy = np.linalg.norm(a), np.linalg.norm(b)
    M = nearest_rotation(np.stack([a / fx, b / fy, m3]))
    centre = -np.linalg.solve(P[:, :3], P[:, 3])
    f = float(np.sqrt(fx * fy))
    camera = sensor.camera(
        (float(centre[0]), float(centre[1]), float(centre[2])),
        angles_from_rotation(M),
        f,
        (float(x0), float(y0)),
        (K1, 0.0),
    )
    px, py = sensor.pixel_size_mm
    return DltSolution(P / P[2, 3], K1, camera, float(py / px * fx / fy))
