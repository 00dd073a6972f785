"""Poses of vertebrae from landmarks in two radiographs, by parallel projection; NumPy only.

Axes of the radiographs: x anterior, y left, z cephalad. The PA view shows y and z, the lateral view x and z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.spine.orientation import axis_from_tilts
from spinewatch.spine.radiograph_landmarks import CommonPoint, LandmarkedVertebra, RadiographView


@dataclass(frozen=True)
class VertebraShapeParameters:
    """What is assumed of the shape of a vertebra.

    Attributes
    ----------
    pedicle_ratio
        Distance of the pedicles from each other over twice their distance behind the centre of the body, W / (2 D). The
        default is that of pedicles 25 mm apart and 18 mm behind the centre.
    pedicle_ratio_sd
        Its standard deviation between vertebrae.
    unknown_rotation_sd_deg
        Standard deviation of the axial rotation of a vertebra without pedicles, whose rotation is set to zero, degrees.
    """

    pedicle_ratio: float = 0.70
    pedicle_ratio_sd: float = 0.10
    unknown_rotation_sd_deg: float = 20.0

    def __post_init__(self) -> None:
        if not (self.pedicle_ratio > 0 and self.unknown_rotation_sd_deg > 0):
            raise ParameterError(
                "pedicle_ratio and unknown_rotation_sd_deg must be positive; correct the parameters"
            )
        if not self.pedicle_ratio_sd >= 0:
            raise ParameterError("pedicle_ratio_sd must not be negative; correct the parameters")


@dataclass(frozen=True, eq=False)
class ProjectedPoses:
    """Poses of vertebrae in the axes of the radiographs.

    Attributes
    ----------
    position_mm
        Centroids of the bodies, shape (n, 3), mm.
    rotation
        Rotations from vertebra to radiograph axes, shape (n, 3, 3).
    factors
        Error of each pose, shape (n, 6, 6): columns are independent, rows as of `Pose.covariance`. Different vertebrae
        are independent.
    """

    position_mm: Float
    rotation: Float
    factors: Float


@dataclass(frozen=True)
class SharedHeights:
    """Comparison of the vertical coordinate, which both views show.

    Attributes
    ----------
    offset_mm
        Height in the PA view minus height in the lateral view, mm.
    rms_mm
        Root mean square of the differences after the offset, mm.
    chi2
        Sum of their squares over their variances.
    dof
        Its degrees of freedom.
    slope
        Difference over height: by how much the scale of the lateral view is smaller than that of the PA view.
    slope_sd
        Its standard deviation.
    """

    offset_mm: float
    rms_mm: float
    chi2: float
    dof: int
    slope: float
    slope_sd: float


def shared_heights(
    pa: RadiographView,
    lateral: RadiographView,
    vertebrae: Sequence[LandmarkedVertebra],
    common: Sequence[CommonPoint],
    landmark_sd_px: float,
) -> SharedHeights:
    """Return how the heights of both views compare: centroids of the bodies and common points.

    Parameters
    ----------
    pa, lateral
        The views.
    vertebrae
        Landmarks of the vertebrae.
    common
        Common points.
    landmark_sd_px
        Standard deviation of a landmark per axis, px.

    Returns
    -------
    SharedHeights
        The offset by weighted least squares, and what remains.
    """
    bodies = [(v.pa_px.mean(axis=0), v.lateral_px.mean(axis=0), 4) for v in vertebrae]
    points = [*bodies, *((c.pa_px, c.lateral_px, 1) for c in common)]
    upper = np.array([pa.to_plane(p)[1] for p, _, _ in points])
    difference = upper - np.array([lateral.to_plane(p)[1] for _, p, _ in points])
    averaged = np.array([count for _, _, count in points])
    row_mm2 = pa.pixel_spacing_mm[0] ** 2 + lateral.pixel_spacing_mm[0] ** 2
    variance = landmark_sd_px**2 * row_mm2 / averaged
    weight = averaged / averaged.sum()
    offset = float(weight @ difference)
    residual = difference - offset
    arm = upper - weight @ upper
    spread = float(weight @ arm**2)
    return SharedHeights(
        offset_mm=offset,
        rms_mm=float(np.sqrt(np.mean(residual**2))),
        chi2=float((residual**2 / variance).sum()),
        dof=len(points) - 1,
        slope=float(weight @ (arm * residual)) / spread,
        slope_sd=float(np.sqrt(landmark_sd_px**2 * row_mm2 / (averaged.sum() * spread))),
    )


def projected_points(
    pa: RadiographView, lateral: RadiographView, common: Sequence[CommonPoint], offset_mm: float
) -> Float:
    """Return common points in the axes of the radiographs.

    Parameters
    ----------
    pa, lateral
        The views.
    common
        The points.
    offset_mm
        Height in the PA view minus height in the lateral view, mm.

    Returns
    -------
    Float
        Points, shape (n, 3), mm; the height is the mean of both views.
    """
    frontal = pa.to_plane(np.stack([point.pa_px for point in common]))
    sagittal = lateral.to_plane(np.stack([point.lateral_px for point in common]))
    return _combined(frontal, sagittal, offset_mm)


def projected_variances(pa: RadiographView, lateral: RadiographView, landmark_sd_px: float) -> Float:
    """Return the variances of `projected_points`.

    Parameters
    ----------
    pa, lateral
        The views.
    landmark_sd_px
        Standard deviation of a landmark per axis, px.

    Returns
    -------
    Float
        Variances along x, y and z, shape (3,), mm^2; the error of the offset, which all heights share, is left out.
    """
    (y, z_pa), (x, z_lateral) = (landmark_sd_px * pa.pixel_mm) ** 2, (landmark_sd_px * lateral.pixel_mm) ** 2
    return np.array([x, y, (z_pa + z_lateral) / 4])


def projected_poses(
    pa: RadiographView,
    lateral: RadiographView,
    vertebrae: Sequence[LandmarkedVertebra],
    offset_mm: float,
    landmark_sd_px: float,
    parameters: VertebraShapeParameters | None = None,
) -> ProjectedPoses:
    """Return the poses of vertebrae in the axes of the radiographs.

    The centroid is the mean of the corners. The ends of an end plate are those of the longest diameter that the view
    shows, which lies in the plane of the end plate: it gives the coronal tilt phi = atan2(-z.Y, z.Z) in the PA view and
    the sagittal tilt atan2(z.X, z.Z) in the lateral view, whatever the other tilt and the axial rotation. The two end
    plates of a body are averaged.

    The axial rotation alpha is the angle in the plane of the end plate between the vertebra's y axis and the line that
    the PA view shows. With the distances a and b of the left and the right pedicle from the centre along that line,
    ``tan(alpha) = W / (2 D) (b - a) / (a + b)``.

    Parameters
    ----------
    pa, lateral
        The views.
    vertebrae
        Landmarks of the vertebrae.
    offset_mm
        Height in the PA view minus height in the lateral view, mm.
    landmark_sd_px
        Standard deviation of a landmark per axis, px.
    parameters
        Shape of a vertebra, by default `VertebraShapeParameters`.

    Returns
    -------
    ProjectedPoses
        Poses with their errors. A vertebra without pedicles has the axial rotation 0 with the deviation
        ``unknown_rotation_sd_deg``.

    References
    ----------
    I. A. F. Stokes, L. C. Bigalow, M. S. Moreland, "Measurement of axial rotation of vertebrae in scoliosis", Spine 11
    (1986) 213-218, for the axial rotation. They tabulate W / (2 D) by level; here it is one value whose variation is a
    part of the error, and distances are measured along the end plates instead of across the film.
    """
    p = parameters or VertebraShapeParameters()
    made = [_pose(pa, lateral, vertebra, offset_mm, landmark_sd_px, p) for vertebra in vertebrae]
    return ProjectedPoses(*(np.stack(parts) for parts in zip(*made, strict=True)))


def rotation_from_end_plates(coronal_rad: Float, sagittal_rad: Float, axial_rad: Float) -> Float:
    """Return the rotation of a vertebra from the angles that the radiographs show.

    Parameters
    ----------
    coronal_rad, sagittal_rad
        Tilts atan2(-z.Y, z.Z) and atan2(z.X, z.Z), shape (...), radians.
    axial_rad
        Angle in the plane of the end plate from its trace in the PA view to the vertebra's y axis, shape (...),
        radians.

    Returns
    -------
    Float
        Rotations, shape (..., 3, 3); columns are the anterior, left and cephalad axes.

    Examples
    --------
    >>> quarter = np.radians(90.0)
    >>> rotation_from_end_plates(np.array(0.0), np.array(0.0), quarter)[:, 0].round(12) + 0.0
    array([0., 1., 0.])
    """
    z = axis_from_tilts(coronal_rad, sagittal_rad)
    trace = np.stack([np.zeros_like(coronal_rad), np.cos(coronal_rad), np.sin(coronal_rad)], axis=-1)
    front = np.cross(trace, z)
    cosine, sine = np.cos(axial_rad)[..., None], np.sin(axial_rad)[..., None]
    return np.stack([cosine * front + sine * trace, cosine * trace - sine * front, z], axis=-1)


def _pose(
    pa: RadiographView,
    lateral: RadiographView,
    vertebra: LandmarkedVertebra,
    offset_mm: float,
    landmark_sd_px: float,
    p: VertebraShapeParameters,
) -> tuple[Float, Float, Float]:
    """Return position (3,), rotation (3, 3) and error factor (6, 6) of a vertebra."""
    known = vertebra.pedicles_px is not None
    frontal_px = (
        vertebra.pa_px if vertebra.pedicles_px is None else np.vstack([vertebra.pa_px, vertebra.pedicles_px])
    )
    frontal, sagittal = pa.to_plane(frontal_px), lateral.to_plane(vertebra.lateral_px)
    values = np.concatenate([frontal.ravel(), sagittal.ravel(), [p.pedicle_ratio]])
    deviations = np.concatenate(
        [
            np.tile(landmark_sd_px * pa.pixel_mm, len(frontal)),
            np.tile(landmark_sd_px * lateral.pixel_mm, len(sagittal)),
            [p.pedicle_ratio_sd],
        ]
    )
    # One row per independent error, a deviation more and a deviation less.
    steps = np.diag(deviations)
    moved = values + np.stack([np.zeros_like(steps), steps, -steps])
    split = frontal.size
    points = (moved[..., :split], moved[..., split:-1])
    planes = [part.reshape(*part.shape[:-1], -1, 2) for part in points]
    position, angles = _position_and_angles(planes[0], planes[1], moved[..., -1], offset_mm)
    rotation = rotation_from_end_plates(*angles)
    factor = np.concatenate(
        [
            (position[1] - position[2]) / 2,
            np.degrees(vector_from_rotation(rotation[1] @ np.swapaxes(rotation[2], -1, -2))) / 2,
        ],
        axis=-1,
    )
    if not known:
        about_z = np.concatenate([np.zeros(3), p.unknown_rotation_sd_deg * rotation[0, 0, :, 2]])
        factor = np.vstack([factor, about_z])
    return position[0, 0], rotation[0, 0], np.asarray(np.linalg.qr(factor, mode="r")).T


def _position_and_angles(
    frontal: Float, sagittal: Float, ratio: Float, offset_mm: float
) -> tuple[Float, tuple[Float, Float, Float]]:
    """Return positions (..., 3) and coronal, sagittal and axial angles (...) from points (..., 4 or 6, 2), mm."""
    corners, pedicles = frontal[..., :4, :], frontal[..., 4:, :]
    centre = corners.mean(axis=-2)
    position = _combined(centre, sagittal.mean(axis=-2), offset_mm)
    plates = corners[..., 0, :] - corners[..., 1, :] + corners[..., 2, :] - corners[..., 3, :]
    coronal = np.arctan2(plates[..., 1], plates[..., 0])
    plates = sagittal[..., 0, :] - sagittal[..., 1, :] + sagittal[..., 2, :] - sagittal[..., 3, :]
    tilt = np.arctan2(-plates[..., 1], plates[..., 0])
    if not pedicles.size:
        return position, (coronal, tilt, np.zeros_like(coronal))
    trace = np.stack([np.cos(coronal), np.sin(coronal)], axis=-1)
    left, right = np.moveaxis(((pedicles - centre[..., None, :]) * trace[..., None, :]).sum(axis=-1), -1, 0)
    # a = left and b = -right
    axial = np.arctan2(-ratio * (left + right), left - right)
    return position, (coronal, tilt, axial)


def _combined(frontal: Float, sagittal: Float, offset_mm: float) -> Float:
    """Return points (..., 3) from (y, z) and (x, z), shape (..., 2), mm."""
    height = (frontal[..., 1] + sagittal[..., 1] + offset_mm) / 2
    return np.stack([sagittal[..., 0], frontal[..., 0], height], axis=-1)
