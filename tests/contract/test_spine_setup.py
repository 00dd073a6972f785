import numpy as np
import pytest
from pydantic import ValidationError

from contract.spine_setup import (
    DIRECTION_SD_DEG,
    LANDMARK_SD_MM,
    CommonLandmark,
    InitialRadiographs,
    PatientDirections,
    PatientLandmarks,
    SpineSetup,
    VertebraPose,
    patient_axes,
    patient_axes_covariance,
    planned_vertebrae,
)
from contract.text import STORED
from spinewatch.spine.patient_axes import PatientAxesError
from tests.store.builders import spine_setup


def test_directions_by_name_or_by_vector() -> None:
    named = PatientDirections(kind="directions", cephalad="+x", left="-y")
    vectors = PatientDirections(kind="directions", cephalad=[2.0, 0.0, 0.0], left=[0.0, -5.0, 0.0])
    # x = y x z: anterior = left x cephalad = -y x +x = +z
    expected = np.column_stack([[0, 0, 1], [0, -1, 0], [1, 0, 0]])
    np.testing.assert_allclose(patient_axes(named), expected, atol=1e-15)
    np.testing.assert_allclose(patient_axes(vectors), expected, atol=1e-15)


def test_landmarks() -> None:
    axes = PatientLandmarks(
        kind="landmarks", caudal_mm=[0.0, 0.0, 0.0], cephalad_mm=[300.0, 0.0, 0.0], left_mm=[150.0, 80.0, 0.0]
    )
    np.testing.assert_allclose(
        patient_axes(axes), np.column_stack([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), atol=1e-12
    )


@pytest.mark.parametrize("sd", [{}, {"direction_sd_deg": 0.0}, {"direction_sd_deg": 3.0}])
def test_directions_without_a_deviation_have_the_usual_one(sd: dict[str, float]) -> None:
    axes = PatientDirections(kind="directions", cephalad="+x", left="-y", **sd)
    assert axes.direction_sd_deg == DIRECTION_SD_DEG
    np.testing.assert_allclose(patient_axes_covariance(axes), DIRECTION_SD_DEG**2 * np.eye(3), atol=1e-12)


@pytest.mark.parametrize("sd", [{}, {"landmark_sd_mm": 0.0}, {"landmark_sd_mm": 7.0}])
def test_landmarks_without_a_deviation_have_the_usual_one(sd: dict[str, float]) -> None:
    axes = PatientLandmarks(
        kind="landmarks",
        caudal_mm=[0.0] * 3,
        cephalad_mm=[400.0, 0.0, 0.0],
        left_mm=[200.0, 100.0, 0.0],
        **sd,
    )
    assert axes.landmark_sd_mm == LANDMARK_SD_MM
    deviations = np.sqrt(np.diag(patient_axes_covariance(axes)))
    np.testing.assert_allclose(deviations, np.degrees([7 / 400 * 2**0.5] * 2 + [7 / 100 * 1.5**0.5]))


def test_a_stated_deviation_of_the_axes_counts_and_is_bounded() -> None:
    axes = PatientDirections(kind="directions", cephalad="+x", left="-y", direction_sd_deg=0.5)
    np.testing.assert_allclose(patient_axes_covariance(axes), 0.25 * np.eye(3), atol=1e-12)
    for wrong in (-1.0, 46.0, float("nan")):
        with pytest.raises(ValidationError, match="direction_sd_deg"):
            PatientDirections(kind="directions", cephalad="+x", left="-y", direction_sd_deg=wrong)


def test_directions_that_determine_no_axes() -> None:
    with pytest.raises(PatientAxesError):
        patient_axes(PatientDirections(kind="directions", cephalad="+x", left="-x"))


def test_a_setup_passes_through_json() -> None:
    setup = spine_setup(levels=["t09", "L1"], target=[{"vertebra": "T9", "angles_deg": [1.0, 2.0, 3.0]}])
    assert setup.levels == ["T9", "L1"]
    assert SpineSetup.model_validate_json(setup.model_dump_json()) == setup


def test_the_target_of_the_library() -> None:
    assert planned_vertebrae(spine_setup()) is None
    target = [
        {"vertebra": "T9", "angles_deg": [1.0, 2.0, 3.0]},
        {"vertebra": "L1", "angles_deg": [0.0, 0.0, 0.0], "position_mm": [1.0, 2.0, 3.0]},
    ]
    planned = planned_vertebrae(spine_setup(target=target))
    assert planned is not None
    assert [item.vertebra for item in planned] == ["T9", "L1"]
    np.testing.assert_array_equal(planned[0].angles_deg, [1, 2, 3])
    assert planned[0].position_mm is None
    np.testing.assert_array_equal(planned[1].position_mm, [1, 2, 3])


@pytest.mark.parametrize("rotation", [{}, {"rotation": np.eye(3).tolist(), "angles_deg": [0.0, 0.0, 0.0]}])
def test_a_pose_has_one_rotation(rotation: dict[str, object]) -> None:
    with pytest.raises(ValidationError, match="either rotation or angles_deg"):
        VertebraPose.model_validate({"vertebra": "T9", "position_mm": [0.0, 0.0, 0.0], **rotation})


def test_a_common_landmark_is_one_point() -> None:
    point = {"name": "P", "pa": [0.0, 0.0], "lateral": [0.0, 0.0]}
    document = {"kind": "radiographs", "pa": "a", "lateral": "b", "vertebrae": [], "common": [point] * 3}
    with pytest.raises(ValidationError, match="either object_mm or triad"):
        InitialRadiographs.model_validate(document)


@pytest.mark.parametrize("name", ["a\u202eb", "a\nb", "a\x07b", "a\u200bb", " a"])
def test_the_name_of_a_common_landmark_hides_nothing(name: str) -> None:
    point = {"name": name, "pa": [0.0, 0.0], "lateral": [0.0, 0.0], "triad": "L1"}
    with pytest.raises(ValidationError, match="remove"):
        CommonLandmark.model_validate(point)
    assert CommonLandmark.model_validate(point, context=STORED).name == name  # earlier versions accepted it
    assert CommonLandmark.model_validate({**point, "name": "tip of screw 1"}).name == "tip of screw 1"
