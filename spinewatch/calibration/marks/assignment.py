"""Assignment of targets to control points: from an approximate camera to a camera that fits, and its significance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from spinewatch.arrays import Float, Int
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.bundle import adjust
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES
from spinewatch.calibration.solve.orientation import solve_pose, with_orientation
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

_LENS = (*EXTERIOR_NAMES, "f", "x0", "y0", "K1")
_LOOSE_TOLERANCE = 1e-5


@dataclass(frozen=True)
class MarkIdentificationParameters:
    """How targets are identified.

    Attributes
    ----------
    min_targets
        Targets that must be identified.
    min_fraction
        Fraction of the targets of an image that a complete assignment identifies.
    focal_widths
        Focal lengths that are tried, in widths of the plate.
    seed_neighbours
        Nearest targets among which a seed of three neighbouring targets is formed.
    min_seed_sine
        Least sine of the angle of a seed.
    control_neighbours
        Nearest control points that can be neighbours in the image.
    max_shape_ratio
        Greatest ratio between the scales of the three sides of a seed and of three control points, seen from above.
    max_triples
        Most similar triples of control points that are tried per seed; limits time and memory for large fields.
    coarse_tolerance
        Residual of a match with an approximate pose, in spacings of the targets, ...
    shrinkage
        ... and as multiples of it in the adjustments that follow.
    fine_tolerance
        Residual of a match with an adjusted camera, in image widths.
    max_sigma
        Standard deviation of an assignment that fits, in image widths.
    max_tight_sigma
        Standard deviation of an assignment that fits tightly, in image widths: required with few targets or when many
        are left out.
    robust_fraction
        Scale of Cauchy's loss as a fraction of the tolerance, ...
    min_robust_px
        ... at least this, px.
    max_evaluations
        Limit of each adjustment; a correct hypothesis needs fewer, others would use hundreds.
    max_hypotheses
        Poses kept per seed and focal length.
    max_seeds
        Seeds that are tried.
    max_adjusted
        Poses of all seeds but the first that are adjusted, in decreasing order of score.
    max_rival_ratio
        Greatest standard deviation of a second assignment, over that of the first, that makes them ambiguous.
    diagnosis_seeds, diagnosis_adjusted
        ``max_seeds`` and ``max_adjusted`` of the search for the reason of a failure.
    estimate_aspect
        Whether py/px is adjusted with the lens.
    """

    min_targets: int = 8
    min_fraction: float = 0.8
    focal_widths: tuple[float, ...] = (1.35, 0.8, 2.4)
    seed_neighbours: int = 5
    min_seed_sine: float = 0.5
    control_neighbours: int = 8
    max_shape_ratio: float = 2.2
    max_triples: int = 1000
    coarse_tolerance: float = 0.35
    shrinkage: tuple[float, float] = (0.6, 0.3)
    fine_tolerance: float = 0.003
    max_sigma: float = 0.0015
    max_tight_sigma: float = 0.0005
    robust_fraction: float = 0.25
    min_robust_px: float = 0.5
    max_evaluations: int = 20
    max_hypotheses: int = 12
    max_seeds: int = 6
    max_adjusted: int = 128
    max_rival_ratio: float = 3.0
    diagnosis_seeds: int = 2
    diagnosis_adjusted: int = 12
    estimate_aspect: bool = False

    @property
    def free(self) -> tuple[str, ...]:
        """Parameters of the camera that are adjusted to many targets."""
        return (*_LENS, "aspect") if self.estimate_aspect else _LENS


@dataclass(frozen=True, eq=False)
class Assignment:
    """Targets assigned to control points.

    Attributes
    ----------
    target
        Indices of the n targets, shape (n,).
    control
        Indices of their control points, shape (n,).
    sigma_px
        Standard deviation per image coordinate, px.
    camera
        The camera that fits.
    """

    target: Int
    control: Int
    sigma_px: float
    camera: Camera

    def __len__(self) -> int:
        return len(self.target)

    def n_common(self, other: Assignment) -> int:
        """Return the number of targets that another assignment identifies as the same points.

        Parameters
        ----------
        other
            The other assignment.

        Returns
        -------
        int
            Number of common pairs.
        """
        pairs, others = (set(zip(a.target.tolist(), a.control.tolist(), strict=True)) for a in (self, other))
        return len(pairs & others)


@dataclass(frozen=True, eq=False)
class IdentificationTask:
    """Targets to be identified in a control field.

    Attributes
    ----------
    pixels
        Centres of the targets, shape (n, 2), px.
    field
        The control field.
    width_px
        Width of the image, px.
    parameters
        How to identify.
    """

    pixels: Float
    field: ControlField
    width_px: int
    parameters: MarkIdentificationParameters

    @property
    def coarse_px(self) -> float:
        """Tolerance of a match with an approximate pose, px."""
        return self.parameters.coarse_tolerance * _spacing_px(self.pixels)

    @property
    def fine_px(self) -> float:
        """Tolerance of a match with an adjusted camera, px."""
        return self.parameters.fine_tolerance * self.width_px

    def is_complete(self, assignment: Assignment) -> bool:
        """Return whether an assignment identifies most of the targets.

        Parameters
        ----------
        assignment
            The assignment.

        Returns
        -------
        bool
            Whether it has the fraction ``min_fraction`` of them.
        """
        return len(assignment) >= self.parameters.min_fraction * len(self.pixels)

    def is_tight(self, assignment: Assignment) -> bool:
        """Return whether an assignment fits tightly.

        Parameters
        ----------
        assignment
            The assignment.

        Returns
        -------
        bool
            Whether its standard deviation is below ``max_tight_sigma``.
        """
        return assignment.sigma_px < self.parameters.max_tight_sigma * self.width_px

    def is_significant(self, assignment: Assignment) -> bool:
        """Return whether an assignment can be excluded to fit by chance.

        Parameters
        ----------
        assignment
            The assignment.

        Returns
        -------
        bool
            Whether it fits tightly and is complete or redundant, or fits and is both.
        """
        redundant = len(assignment) > len(self.parameters.free)
        if self.is_tight(assignment):
            return self.is_complete(assignment) or redundant
        fits = assignment.sigma_px < self.parameters.max_sigma * self.width_px
        return fits and redundant and self.is_complete(assignment)


def match_points(camera: Camera, pixels: Float, points_mm: Float, tolerance_px: float) -> tuple[Int, Int]:
    """Return the targets and control points that correspond one to one, of least total distance.

    Parameters
    ----------
    camera
        Camera that projects the control points.
    pixels
        Targets, shape (n, 2), px.
    points_mm
        Control points, shape (m, 3), mm.
    tolerance_px
        Greatest distance of a pair, px.

    Returns
    -------
    target, control : Int
        Indices of corresponding targets and control points, shape (k,).

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera = table_3_3_rig().left
    >>> X = np.array([[400.0, 400.0, 0.0], [450.0, 400.0, 30.0], [400.0, 350.0, 60.0]])
    >>> target, control = match_points(camera, camera.project(X[[2, 0]]) + 0.5, X, 2.0)
    >>> target.tolist(), control.tolist()
    ([0, 1], [2, 0])
    """
    with np.errstate(all="ignore"):
        predicted = camera.project(points_mm)
    d = np.linalg.norm(pixels[:, None] - predicted[None], axis=2)
    d = np.where(np.isfinite(d), np.minimum(d, 2 * tolerance_px), 2 * tolerance_px)
    i, j = linear_sum_assignment(d)
    near = d[i, j] < tolerance_px
    return i[near], j[near]


def refine_assignment(camera: Camera, task: IdentificationTask) -> Assignment | None:
    """Return the assignment that follows from an approximate camera.

    Targets are matched, the camera is adjusted with more and more of the lens, and targets are matched with smaller
    tolerances.

    Parameters
    ----------
    camera
        Approximate camera.
    task
        Targets and control field.

    Returns
    -------
    Assignment or None
        A significant assignment, or None.

    Raises
    ------
    ConvergenceError
        If the adjustment fails.
    """
    parameters, coarse, fine = task.parameters, task.coarse_px, task.fine_px
    target, control = match_points(camera, task.pixels, task.field.points_mm, coarse)
    if len(target) < parameters.min_targets:
        return None
    camera = with_orientation(camera, solve_pose(_matched(target, control, task), camera))
    at_once = _assign(camera, task, len(EXTERIOR_NAMES))
    if at_once is not None and task.is_complete(at_once) and task.is_tight(at_once):
        return at_once
    first, second = parameters.shrinkage
    steps = (
        (first * coarse, (*EXTERIOR_NAMES, "f", "K1")),
        (second * coarse, parameters.free),
        (fine, parameters.free),
    )
    for tolerance, free in steps:
        target, control = match_points(camera, task.pixels, task.field.points_mm, max(tolerance, fine))
        if len(target) < parameters.min_targets:
            return None
        usable = free if 2 * len(target) > len(free) + 2 else (*EXTERIOR_NAMES, "f")
        image = _matched(target, control, task)
        adjusted = adjust(
            Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (usable,)),
            robust_scale=max(parameters.robust_fraction * tolerance, parameters.min_robust_px),
            tolerance=_LOOSE_TOLERANCE,
            max_evaluations=parameters.max_evaluations,
        )
        camera = adjusted.block.cameras[0]
        if camera.pixel_size_mm[1] <= 0:  # a mirrored image
            return None
    return _assign(camera, task, len(parameters.free))


def assign_with_lens(camera: Camera, lens: Camera, n_min: int, task: IdentificationTask) -> Assignment | None:
    """Return the assignment of an approximate camera when its interior orientation is known.

    Parameters
    ----------
    camera
        Approximate camera.
    lens
        Camera with the interior orientation.
    n_min
        Fewest targets that must match the approximate camera.
    task
        Targets and control field.

    Returns
    -------
    Assignment or None
        A significant assignment, or None.

    Raises
    ------
    ConvergenceError
        If the matched targets determine no pose.
    """
    target, control = match_points(camera, task.pixels, task.field.points_mm, task.coarse_px)
    if len(target) < n_min:
        return None
    pose = solve_pose(_matched(target, control, task), lens)
    return _assign(with_orientation(lens, pose), task, len(EXTERIOR_NAMES))


def _assign(camera: Camera, task: IdentificationTask, n_unknowns: int) -> Assignment | None:
    """Return the assignment of the targets near the points that a camera projects, if it is significant."""
    target, control = match_points(camera, task.pixels, task.field.points_mm, task.fine_px)
    dof = 2 * len(target) - n_unknowns
    if len(target) < task.parameters.min_targets or dof <= 0:
        return None
    residual = camera.project(task.field.points_mm[control]) - task.pixels[target]
    assignment = Assignment(target, control, float(np.sqrt((residual**2).sum() / dof)), camera)
    return assignment if task.is_significant(assignment) else None


def _matched(target: Int, control: Int, task: IdentificationTask) -> ImagePoints:
    ids = [task.field.ids[i] for i in control]
    return ImagePoints.build(ids, task.field.points_mm[control], task.pixels[target])


def _spacing_px(pixels: Float) -> float:
    """Return the median distance of a target to its nearest neighbour."""
    d = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
    np.fill_diagonal(d, np.inf)
    return float(np.median(d.min(axis=1)))
