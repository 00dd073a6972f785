"""The initial configuration from simulated radiographs: truth within the stated errors, and bad input."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.simulation.radiographs import FilmParameters, RadiographScene, radiograph_scene
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, random_scoliosis
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.spine.radiograph_fit import CommonPointsError, RadiographScaleError
from spinewatch.spine.radiograph_landmarks import CommonPoint, RadiographLandmarksError, RadiographView
from spinewatch.spine.radiographs import RadiographFit, initial_from_radiographs
from tests.spinewatch.spine.radiograph_scenes import HEIGHT_OFFSET_MM, LATERAL, OBJECT, PA, scene, seen

SD_PX = 2.0


def result(scene: RadiographScene, seed: int, sd_px: float = SD_PX) -> tuple[InitialSpine, RadiographFit]:
    shown = seen(scene, sd_px, seed)
    return initial_from_radiographs(
        PA, LATERAL, shown.vertebrae, shown.common, sd_px, patient_axes=OBJECT.rotation
    )


def errors(initial: InitialSpine, scene: RadiographScene) -> Float:
    """Return truth minus result, shape (n, 6), mm and degrees about the object axes."""
    turn = vector_from_rotation(scene.rotation @ np.swapaxes(initial.rotation, -1, -2))
    return np.concatenate([scene.position_mm - initial.position_mm, np.degrees(turn)], axis=1)


@cache
def trials() -> tuple[Float, Float, Float, Float, tuple[str, ...]]:
    """Return errors and deviations (200, 17, 6), chi-squared of single poses and of L1 against T6, and flags."""
    found, deviations, single, differences, flags = [], [], [], [], []
    upper, lower = LEVELS.index("T6"), LEVELS.index("L1")
    for seed in range(200):
        exact = scene(seed, ratio_sd=0.10)
        initial, fit = result(exact, 10_000 + seed)
        e, F = errors(initial, exact), initial.errors
        S = F @ np.swapaxes(F, -1, -2)
        found.append(e)
        deviations.append(np.sqrt(np.diagonal(S, axis1=-2, axis2=-1)))
        single.append(np.einsum("ni,nij,nj->n", e, np.linalg.inv(S), e))
        between, difference = e[upper] - e[lower], F[upper] - F[lower]
        differences.append(between @ np.linalg.solve(difference @ difference.T, between))
        flags += [flag.code for flag in fit.flags]
    return np.array(found), np.array(deviations), np.array(single), np.array(differences), tuple(flags)


def test_exact_landmarks_give_the_exact_spine() -> None:
    exact = scene(1, object_sd_mm=0.0)
    initial, fit = initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common, 0.1)
    assert np.abs(errors(initial, exact)).max() < 1e-6
    assert initial.levels == LEVELS
    assert initial.kind is InitialKind.RADIOGRAPHS
    assert fit.flags == ()
    assert fit.enlargement == 1.0
    assert fit.heights.offset_mm == pytest.approx(HEIGHT_OFFSET_MM)


def test_the_truth_lies_within_the_stated_errors() -> None:
    found, deviations, single, _, _ = trials()
    inside = (np.abs(found) < 1.96 * deviations).mean(axis=(0, 1))
    assert (np.abs(inside - 0.95) < 0.02).all(), inside
    assert single.mean() == pytest.approx(6, rel=0.06)


def test_the_errors_that_vertebrae_share_are_stated_as_shared() -> None:
    _, _, _, differences, _ = trials()
    assert differences.mean() == pytest.approx(6, rel=0.15)  # 200 of chi-squared 6: sd 0.25


def test_sound_radiographs_are_rarely_flagged() -> None:
    assert len(trials()[4]) <= 4  # five tests, of which four at 0.001, in 200 pairs: 0.8 expected


def test_errors_scale_with_the_deviation_of_a_landmark() -> None:
    exact = scene(2, object_sd_mm=0.0)
    one, two = (
        initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common, sd)[0] for sd in (0.5, 1.0)
    )
    ratio = np.linalg.norm(two.errors[:, :3], axis=-1) / np.linalg.norm(one.errors[:, :3], axis=-1)
    np.testing.assert_allclose(ratio, 2, rtol=1e-3)


def test_the_order_of_vertebrae_does_not_matter() -> None:
    exact = scene(4)
    one, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common)
    two, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae[::-1], exact.common[::-1])
    assert two.levels == one.levels
    np.testing.assert_allclose(two.position_mm, one.position_mm, atol=1e-9)
    np.testing.assert_allclose(two.rotation, one.rotation, atol=1e-9)


def test_moving_object_space_moves_the_spine_with_it() -> None:
    exact = scene(5)
    R, t = rotation_from_vector(np.array([1.0, 0.5, -2.0])), np.array([5.0, 700.0, -30.0])
    common = [
        dataclasses.replace(c, object_mm=R @ c.object_mm + t, covariance_mm2=R @ c.covariance_mm2 @ R.T)
        for c in exact.common
    ]
    one, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common)
    two, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae, common)
    np.testing.assert_allclose(two.position_mm, one.position_mm @ R.T + t, atol=1e-8)
    np.testing.assert_allclose(two.rotation, R @ one.rotation, atol=1e-9)
    S = one.errors[0] @ one.errors[0].T
    J = np.kron(np.eye(2), R)
    np.testing.assert_allclose(two.errors[0] @ two.errors[0].T, J @ S @ J.T, atol=1e-6)


def test_the_side_that_an_image_shows_does_not_matter_when_it_is_stated() -> None:
    exact = scene(6)
    width = 3000.0

    def mirrored(points: Float) -> Float:
        return points * [-1, 1] + [width, 0]

    vertebrae = [
        dataclasses.replace(v, pa_px=mirrored(v.pa_px), pedicles_px=mirrored(v.pedicles_px))  # type: ignore[arg-type]
        for v in exact.vertebrae
    ]
    common = [dataclasses.replace(c, pa_px=mirrored(c.pa_px)) for c in exact.common]
    other = RadiographView(PA.pixel_spacing_mm, "right")
    one, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common)
    two, _ = initial_from_radiographs(other, LATERAL, vertebrae, common)
    np.testing.assert_allclose(two.position_mm, one.position_mm, atol=1e-7)


def test_vertebrae_without_pedicles_are_named() -> None:
    exact = scene(7)
    vertebrae = list(exact.vertebrae)
    vertebrae[3] = dataclasses.replace(vertebrae[3], pedicles_px=None)
    initial, fit = initial_from_radiographs(PA, LATERAL, vertebrae, exact.common)
    (flag,) = fit.flags
    assert flag.code == "radiograph-rotation-unknown"
    assert flag.detail.startswith("T4: ")
    sd = np.linalg.norm(initial.errors[:, 3:], axis=(1, 2))
    assert sd[3] > 19.9
    assert sd[4] < 10


def test_views_of_different_scale_are_flagged_with_the_difference() -> None:
    exact = scene(8)
    wrong = RadiographView((0.20 * 0.97, 0.20 * 0.97), "right")
    shown = seen(exact, SD_PX, 1)
    _, fit = initial_from_radiographs(PA, wrong, shown.vertebrae, shown.common, SD_PX)
    flag = next(flag for flag in fit.flags if flag.code == "radiograph-heights-differ")
    assert "smaller by 3." in flag.detail or "smaller by 2.9" in flag.detail


def test_spacings_of_rows_and_columns_that_differ_are_flagged_and_used_as_they_are() -> None:
    films = FilmParameters(
        pa=RadiographView((0.20, 0.18), "left"),
        lateral=RadiographView((0.20, 0.22), "right"),
        pedicle_ratio_sd=0.0,
        object_sd_mm=0.0,
    )
    rng = np.random.default_rng(21)
    spine = random_scoliosis(rng, CurveKind.THORACIC).poses
    exact = radiograph_scene(LEVELS, spine.position_mm, spine.rotation, OBJECT, rng, films)
    initial, fit = initial_from_radiographs(films.pa, films.lateral, exact.vertebrae, exact.common, 0.1)
    assert np.abs(errors(initial, exact)).max() < 1e-6
    (flag,) = fit.flags
    assert flag.code == "radiograph-spacing-unequal"
    assert "0.2 and 0.18 mm in the PA view and 0.2 and 0.22 mm in the lateral view" in flag.detail


@pytest.mark.parametrize(("column_mm", "flagged"), [(0.2019, False), (0.2021, True), (0.1979, True)])
def test_a_difference_of_more_than_a_hundredth_is_flagged(column_mm: float, flagged: bool) -> None:
    exact = scene(8)
    view = RadiographView((0.20, column_mm), "left")
    _, fit = initial_from_radiographs(view, LATERAL, exact.vertebrae, exact.common)
    assert ("radiograph-spacing-unequal" in {flag.code for flag in fit.flags}) is flagged


def test_another_posture_enlarges_the_errors() -> None:
    exact = scene(9)
    random = np.random.default_rng(9)
    common = [
        dataclasses.replace(c, object_mm=c.object_mm + 3 * random.standard_normal(3)) for c in exact.common
    ]
    good, _ = initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common)
    bad, fit = initial_from_radiographs(PA, LATERAL, exact.vertebrae, common)
    assert fit.enlargement > 2
    ratio = np.linalg.norm(bad.errors[0]) / np.linalg.norm(good.errors[0])
    assert ratio == pytest.approx(fit.enlargement, rel=0.05)
    assert {flag.code for flag in fit.flags} & {"radiograph-points-disagree", "radiograph-point-doubtful"}


def against_axes(rotation_deg: list[float], sd_deg: float, seed: int = 3) -> list[str]:
    """Return the flags of radiographs against axes that are turned and have a deviation."""
    shown = seen(scene(seed), SD_PX, seed)
    _, fit = initial_from_radiographs(
        PA,
        LATERAL,
        shown.vertebrae,
        shown.common,
        SD_PX,
        patient_axes=OBJECT.rotation @ rotation_from_vector(np.radians(rotation_deg)),
        axes_covariance_deg2=sd_deg**2 * np.eye(3),
    )
    return [flag.detail for flag in fit.flags if flag.code == "radiograph-axes-differ"]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_patient_axes_that_contradict_the_fit_are_flagged_and_then_refused(axis: int) -> None:
    def about(degrees: float) -> list[float]:
        return [degrees * (axis == each) for each in range(3)]

    assert against_axes(about(0), 3.0) == against_axes(about(11), 3.0) == []
    (detail,) = against_axes(about(20), 3.0)
    assert "the axes of the radiographs show patient axes that are turned by" in detail
    assert 17 < float(detail.split("turned by ")[1].split(" ")[0]) < 23
    for degrees in (40, 90, 180):
        with pytest.raises(PatientAxesContradictedError, match=r"turned by \d+ degrees"):
            against_axes(about(degrees), 3.0)
    assert against_axes(about(28), 12.0) == []


def test_axes_of_radiographs_and_setup_that_err_as_stated_are_hardly_ever_flagged() -> None:
    flagged = 0
    for seed in range(400):
        errors_deg = np.random.default_rng([5, seed]).normal(0, 3, (2, 3))
        # The films err against the patient, and so do the stated axes: small rotations add up.
        flagged += bool(against_axes(list(errors_deg.sum(axis=0)), 3.0, seed % 20))
    assert flagged <= 2


@pytest.mark.parametrize("sd_px", [0.0, -1.0, np.nan, np.inf])
def test_a_deviation_that_is_not_positive_is_refused(sd_px: float) -> None:
    exact = scene(0)
    with pytest.raises(ParameterError, match="landmark_sd_px"):
        initial_from_radiographs(PA, LATERAL, exact.vertebrae, exact.common, sd_px)


def test_no_vertebra_and_no_common_point_are_refused() -> None:
    exact = scene(0)
    with pytest.raises(RadiographLandmarksError, match="no vertebra"):
        initial_from_radiographs(PA, LATERAL, [], exact.common)
    with pytest.raises(CommonPointsError, match="0 common points"):
        initial_from_radiographs(PA, LATERAL, exact.vertebrae, [])


def test_a_common_point_given_twice_is_refused() -> None:
    exact = scene(0)
    with pytest.raises(RadiographLandmarksError, match="screw 1 is given twice"):
        initial_from_radiographs(PA, LATERAL, exact.vertebrae, [*exact.common, exact.common[0]])


def test_the_spacing_at_the_detector_is_refused_by_its_scale() -> None:
    exact = scene(0, object_sd_mm=0.0)
    detector = [
        RadiographView((v.pixel_spacing_mm[0] * 1.1, v.pixel_spacing_mm[1] * 1.1), v.positive_on)
        for v in (PA, LATERAL)
    ]
    with pytest.raises(RadiographScaleError, match=r"0\.909"):
        initial_from_radiographs(detector[0], detector[1], exact.vertebrae, exact.common)


def test_common_points_on_the_midline_alone_are_refused() -> None:
    exact = scene(0)
    common = []
    for k, z in enumerate(np.linspace(-200, 200, 6)):
        point = np.array([0.0, 0.0, z])
        base = exact.common[0]
        common.append(
            CommonPoint(
                f"{k}", base.pa_px * 0 + [0, -z / 0.2], base.lateral_px * 0 + [0, -z / 0.2], point, np.eye(3)
            )
        )
    with pytest.raises(CommonPointsError, match="one line"):
        initial_from_radiographs(PA, LATERAL, exact.vertebrae, common)
