"""Space resection with self-calibration: one camera from one or several shots of a control field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.calibration.errors import ConvergenceError, PoorFitError, UndeterminedError
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.blunders import Blunder, adjust_without_blunders
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_from_vector, camera_vector
from spinewatch.calibration.solve.initial_values import initial_cameras
from spinewatch.calibration.solve.orientation import object_to_camera, solve_pose, with_orientation
from spinewatch.calibration.solve.parameter_selection import BASE_NAMES, free_names, select_parameters
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform

_LOOSE_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class Resection:
    """One camera from its own images.

    Attributes
    ----------
    adjustment
        Adjustment of a block of this camera alone, in the shots that it has in view.
    blunders
        Removed points.
    shots
        Indices of those shots.
    """

    adjustment: BundleAdjustment
    blunders: tuple[Blunder, ...]
    shots: tuple[int, ...]

    @property
    def camera(self) -> Camera:
        """The camera."""
        return self.adjustment.block.cameras[0]

    @property
    def placements(self) -> dict[int, RigidTransform]:
        """Motion from the board's frame to object space by index of the shot."""
        return dict(zip(self.shots, self.adjustment.block.placements, strict=True))

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the adjusted parameters."""
        return self.adjustment.block.free[0]


def resect(
    images: Sequence[ImagePoints | None],
    sensor: Sensor,
    parameters: SolveParameters,
    where: str = "the camera",
) -> Resection:
    """Return one camera from its images.

    Initial values are adjusted until one determines the focal length well, or else all of them, and the best is kept.
    Blunders are removed. Parameters that the points do not determine or do not need stay at zero.

    Parameters
    ----------
    images
        Image points of each shot, None for a shot with too few points. The first shot in view defines object space.
    sensor
        The sensor.
    parameters
        How to solve.
    where
        Name of the camera in error messages.

    Returns
    -------
    Resection
        The camera, its accuracy and the removed points.

    Raises
    ------
    TooFewPointsError, PlanarFieldError, MirroredFieldError, UndeterminedError
        If the points determine no camera.
    PoorFitError
        If the residuals of the best camera are too large.
    ConvergenceError
        If no initial value leads to a camera that has the points in view.

    References
    ----------
    Thesis eq. 3.4 and section 3.2. Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), sections 4.2.3
    and 4.4.2.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> image = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    >>> found = resect([image], Sensor.of_camera(camera), SolveParameters())
    >>> abs(found.camera.focal_length_mm - camera.focal_length_mm) < 1e-6
    True
    """
    shots = tuple(s for s, image in enumerate(images) if image is not None)
    in_view = [image for image in images if image is not None]
    initial = _best_initial_adjustment(in_view, sensor, parameters, where)
    try:
        clean, _ = adjust_without_blunders(initial.block, parameters.blunders)
        selected = _selected(clean, parameters, sensor, where)
        all_points = replace(selected.block, images=initial.block.images)
        final, blunders = adjust_without_blunders(all_points, parameters.blunders)
        _check_fit(final, parameters, sensor)
    except (PoorFitError, ConvergenceError) as error:
        raise type(error)(f"{where}: {error}") from error
    return Resection(final, tuple(replace(b, shot=shots[b.shot]) for b in blunders), shots)


def _selected(
    clean: BundleAdjustment, parameters: SolveParameters, sensor: Sensor, where: str
) -> BundleAdjustment:
    """Return the adjustment with selected parameters; points that fit no camera are named as such first."""
    try:
        return select_parameters(clean, parameters, sensor, where)
    except UndeterminedError:
        _check_fit(clean, parameters, sensor)
        raise


def _check_fit(adjustment: BundleAdjustment, parameters: SolveParameters, sensor: Sensor) -> None:
    if not adjustment.rms_px < parameters.max_rms_of_width * sensor.image_size_px[0]:
        raise PoorFitError(
            f"the image residuals of the best camera are {adjustment.rms_px:.1f} px RMS; check that the control field"
            " is the one in the image and that points are named correctly"
        )


def _best_initial_adjustment(
    images: Sequence[ImagePoints], sensor: Sensor, parameters: SolveParameters, where: str
) -> BundleAdjustment:
    """Return the first sufficient adjustment, or else the robust one of least cost, of all initial values."""
    free = free_names(parameters.free or BASE_NAMES, parameters)
    cameras = initial_cameras(
        images, sensor, where, parameters.fixed.get("f"), parameters.initial_values, parameters.dlt
    )
    robust: list[BundleAdjustment] = []
    for camera in cameras:
        try:
            block = _oriented_block(camera, images, free, parameters)
            adjusted = adjust(block, tolerance=_LOOSE_TOLERANCE)
            if _is_sufficient(adjusted, parameters):
                return adjusted
            robust.append(
                adjust(adjusted.block, robust_scale=parameters.robust_px, tolerance=_LOOSE_TOLERANCE)
            )
        except ConvergenceError:  # the points are out of view of this initial value
            continue
    if not robust:
        raise ConvergenceError(
            f"{where}: no initial value leads to a camera that has the points in view; check their coordinates"
        )
    return min(robust, key=lambda adjustment: _cauchy_cost(adjustment, parameters.robust_px))


def _is_sufficient(adjustment: BundleAdjustment, parameters: SolveParameters) -> bool:
    """Return whether the focal length is determined well enough to exclude another minimum nearby."""
    f = adjustment.block.cameras[0].focal_length_mm
    sd = adjustment.camera_sd(0).get("f", np.inf)
    return adjustment.rms_px < parameters.sufficient_rms_px and sd < parameters.sufficient_focal_sd * f


def _cauchy_cost(adjustment: BundleAdjustment, scale_px: float) -> float:
    return float(sum(np.log1p((r / scale_px) ** 2).sum() for r in adjustment.residuals_px.values()))


def _with_fixed(camera: Camera, parameters: SolveParameters) -> Camera:
    vector = camera_vector(camera)
    for name, value in parameters.fixed.items():
        vector[PARAMETER_NAMES.index(name)] = value
    return camera_from_vector(vector, camera)


def _oriented_block(
    camera: Camera, images: Sequence[ImagePoints], free: tuple[str, ...], parameters: SolveParameters
) -> Block:
    """Return the block with the exterior orientation and the placements that this interior orientation gives."""
    camera = _with_fixed(camera, parameters)
    first, *others = (solve_pose(image, camera) for image in images)
    oriented = _with_fixed(with_orientation(camera, first), parameters)
    to_object = object_to_camera(oriented).inverse()
    placements = (RigidTransform.identity(), *(to_object @ to_camera for to_camera in others))
    return Block((oriented,), placements, {(0, s): image for s, image in enumerate(images)}, (free,))
