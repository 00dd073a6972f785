"""The initial configuration of a spine from a PA and a lateral radiograph; NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.spine.axes_checks import AxesCheckParameters, AxesEvidence, axes_doubt
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.spine.radiograph_fit import (
    RadiographFitParameters,
    SimilarityFit,
    chi2_p_value,
    disagreement,
    fit_common_points,
    fit_flags,
)
from spinewatch.spine.radiograph_geometry import (
    SharedHeights,
    VertebraShapeParameters,
    projected_points,
    projected_poses,
    projected_variances,
    shared_heights,
)
from spinewatch.spine.radiograph_landmarks import (
    CommonPoint,
    LandmarkedVertebra,
    RadiographLandmarksError,
    RadiographView,
    in_anatomical_order,
    require_consistent,
)
from spinewatch.spine.radiograph_mirror import mirror_flags


@dataclass(frozen=True)
class RadiographParameters:
    """Parameters of an initial configuration from radiographs.

    Attributes
    ----------
    shape
        Shape of a vertebra.
    fit
        Limits of the fit to object space.
    film_sd_deg
        Standard deviation of the axes of the radiographs against the patient's, about each of them, degrees.
    axes
        Limits of the rotation between the two axes.
    max_spacing_difference
        Largest relative difference of the distances of rows and columns that is not flagged. Pixels of radiographs are
        square; a difference of 2% changes Cobb angles by 0.7 degrees, one of 10% by 3.5 (median of simulated pairs).
    """

    shape: VertebraShapeParameters = field(default_factory=VertebraShapeParameters)
    fit: RadiographFitParameters = field(default_factory=RadiographFitParameters)
    film_sd_deg: float = 3.0
    axes: AxesCheckParameters = field(default_factory=AxesCheckParameters)
    max_spacing_difference: float = 0.01


@dataclass(frozen=True, eq=False)
class RadiographFit:
    """How the radiographs fit to object space and to each other.

    Attributes
    ----------
    similarity
        The seven-parameter fit.
    heights
        Comparison of the vertical coordinate, which both views show.
    enlargement
        Factor by which all errors were enlarged because the common points disagree; 1 if they do not.
    flags
        What is doubtful.
    """

    similarity: SimilarityFit
    heights: SharedHeights
    enlargement: float
    flags: tuple[Flag, ...]


def initial_from_radiographs(  # noqa: PLR0913
    pa: RadiographView,
    lateral: RadiographView,
    vertebrae: Sequence[LandmarkedVertebra],
    common: Sequence[CommonPoint],
    landmark_sd_px: float = 1.0,
    extra_levels: Sequence[str] = (),
    parameters: RadiographParameters | None = None,
    patient_axes: Float | None = None,
    *,
    axes_covariance_deg2: Float | None = None,
) -> tuple[InitialSpine, RadiographFit]:
    """Return the poses of vertebrae in object space from landmarks in two radiographs.

    The views are parallel projections perpendicular to each other, with the same scale; their vertical offset is
    estimated. Poses in the axes of the radiographs are transformed to object space by the seven-parameter fit of common
    points. An error of the offset moves all points together, so that the fit removes it.

    Parameters
    ----------
    pa, lateral
        The views.
    vertebrae
        Landmarks of the vertebrae, in any order.
    common
        Points that the cameras show too, at least three.
    landmark_sd_px
        Standard deviation of a digitized point per axis, px; errors of different points are independent.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    parameters
        Parameters, by default `RadiographParameters`.
    patient_axes
        Rotation from patient to object axes as it was stated, shape (3, 3), to be compared with the fit; None leaves
        the comparison out.
    axes_covariance_deg2
        Covariance of a small rotation of the stated axes about themselves, shape (3, 3), degrees^2; None for exact
        axes.

    Returns
    -------
    initial : InitialSpine
        Poses with their errors: six columns per vertebra, and seven of the transform, which are common to all.
    fit : RadiographFit
        The fit, its residuals and flags.

    Raises
    ------
    RadiographLandmarksError
        If landmarks contradict each other.
    CommonPointsError
        If the common points do not determine a transform.
    RadiographScaleError
        If the scale is not that of true millimetres.
    LevelError
        If a vertebra's name is not one.
    PatientAxesContradictedError
        If the axes of the radiographs are turned too far against the stated ones.

    References
    ----------
    clinical.md, "From triads to vertebrae"; I. A. F. Stokes et al., Spine 11 (1986) 213-218 for the axial rotation;
    S. Umeyama, IEEE PAMI 13 (1991) 376 for the transform.
    """
    p = parameters or RadiographParameters()
    if not 0 < landmark_sd_px < np.inf:
        raise ParameterError("landmark_sd_px must be positive; correct it")
    if not vertebrae:
        raise RadiographLandmarksError("there is no vertebra with landmarks; digitize at least two")
    ordered = in_anatomical_order(vertebrae, extra_levels)
    require_consistent(pa, lateral, ordered)
    _require_distinct([point.name for point in common])
    heights = shared_heights(pa, lateral, ordered, common, landmark_sd_px)
    source = projected_points(pa, lateral, common, heights.offset_mm) if common else np.zeros((0, 3))

    def fit_of(source_mm: Float) -> SimilarityFit:
        return fit_common_points(
            [point.name for point in common],
            source_mm,
            projected_variances(pa, lateral, landmark_sd_px),
            np.array([point.object_mm for point in common]),
            np.array([point.covariance_mm2 for point in common]),
            p.fit,
        )

    def has_other_axes(fit: SimilarityFit) -> bool:
        try:
            return bool(_axes_flags(fit, patient_axes, axes_covariance_deg2, p))
        except PatientAxesContradictedError:
            return True

    similarity = fit_of(source)
    flags = (
        *_spacing_flags(pa, lateral, p.max_spacing_difference),
        *fit_flags(similarity, p.fit),
        *_height_flags(heights, p.fit),
        *_rotation_flags(ordered, p.shape),
        *_axes_flags(similarity, patient_axes, axes_covariance_deg2, p),
        *mirror_flags(fit_of, source, has_other_axes, p.fit),
    )
    poses = projected_poses(pa, lateral, ordered, heights.offset_mm, landmark_sd_px, p.shape)
    R, scale = similarity.transform.rotation, similarity.transform.scale
    position = similarity.transform(poses.position_mm)
    own = np.concatenate([scale * R @ poses.factors[:, :3], R @ poses.factors[:, 3:]], axis=1)
    enlargement = disagreement(similarity, p.fit)
    initial = InitialSpine(
        kind=InitialKind.RADIOGRAPHS,
        levels=tuple(vertebra.level for vertebra in ordered),
        position_mm=position,
        rotation=R @ poses.rotation,
        errors=enlargement * np.concatenate([_apart(own), similarity.pose_factor(position)], axis=-1),
    )
    return initial, RadiographFit(similarity, heights, enlargement, flags)


def _apart(factors: Float) -> Float:
    """Return factors (n, 6, 6) of independent poses as one factor (n, 6, 6n)."""
    n = len(factors)
    whole = np.zeros((n, 6, n, 6))
    whole[np.arange(n), :, np.arange(n), :] = factors
    return whole.reshape(n, 6, 6 * n)


def _require_distinct(names: Sequence[str]) -> None:
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise RadiographLandmarksError(f"common point {repeated} is given twice; give each name once")


def _spacing_flags(pa: RadiographView, lateral: RadiographView, limit: float) -> tuple[Flag, ...]:
    unequal = [
        f"{row:g} and {column:g} mm in the {name} view"
        for name, (row, column) in (("PA", pa.pixel_spacing_mm), ("lateral", lateral.pixel_spacing_mm))
        if max(row, column) > (1 + limit) * min(row, column)
    ]
    if not unequal:
        return ()
    return (
        Flag(
            "radiograph-spacing-unequal",
            f"the distances of rows and of columns are {' and '.join(unequal)}, and differ by more than {limit:.0%};"
            " pixels of radiographs are square, and a wrong distance turns every tilt; correct the pixel spacing",
        ),
    )


def _height_flags(heights: SharedHeights, p: RadiographFitParameters) -> tuple[Flag, ...]:
    if chi2_p_value(heights.chi2, heights.dof) >= p.significance:
        return ()
    return (
        Flag(
            "radiograph-heights-differ",
            f"heights in the two views differ by {heights.rms_mm:.1f} mm RMS after their offset of"
            f" {heights.offset_mm:.1f} mm (chi-squared {heights.chi2:.0f} of {heights.dof}); the lateral scale is"
            f" smaller by {heights.slope:.1%}, standard deviation {heights.slope_sd:.1%}",
        ),
    )


def _rotation_flags(vertebrae: Sequence[LandmarkedVertebra], p: VertebraShapeParameters) -> tuple[Flag, ...]:
    names = ", ".join(vertebra.level for vertebra in vertebrae if vertebra.pedicles_px is None)
    if not names:
        return ()
    return (
        Flag(
            "radiograph-rotation-unknown",
            f"{names}: no pedicles were digitized, so that the axial rotation is set to 0 with a standard deviation of"
            f" {p.unknown_rotation_sd_deg:.0f} degrees",
        ),
    )


def _axes_flags(
    fit: SimilarityFit, stated: Float | None, axes_covariance_deg2: Float | None, p: RadiographParameters
) -> tuple[Flag, ...]:
    if stated is None:
        return ()
    turn = np.degrees(vector_from_rotation(stated.T @ fit.transform.rotation))
    of_fit = np.degrees(np.degrees(stated.T @ fit.covariance[3:6, 3:6] @ stated))
    information = np.asarray(np.linalg.inv(of_fit + p.film_sd_deg**2 * np.eye(3)), dtype=float)
    evidence = AxesEvidence("the axes of the radiographs show", turn, information)
    exact = np.zeros((3, 3)) if axes_covariance_deg2 is None else axes_covariance_deg2
    doubt = axes_doubt(evidence, exact, p.axes)
    return () if doubt is None else (Flag("radiograph-axes-differ", doubt),)
