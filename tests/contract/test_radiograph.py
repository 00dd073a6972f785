"""Landmarks and fits between the contract and the library."""

import json
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from contract.radiograph import (
    NewRadiographFit,
    Radiograph,
    RadiographFit,
    common_points,
    landmarked_vertebra,
)
from contract.spine_setup import InitialRadiographs
from spinewatch.spine.radiographs import initial_from_radiographs
from tests.contract.results import pose
from tests.spinewatch.spine.radiograph_scenes import LATERAL, PA, scene, to_document

EXACT = scene(3)
DOCUMENT = to_document(EXACT, pa="a", lateral="b")


def test_landmarks_pass_to_the_library_unchanged() -> None:
    initial = InitialRadiographs.model_validate(DOCUMENT)
    for given, made in zip(EXACT.vertebrae, map(landmarked_vertebra, initial.vertebrae), strict=True):
        assert made.level == given.level
        for name in ("pa_px", "lateral_px", "pedicles_px"):
            assert getattr(made, name).tobytes() == np.ascontiguousarray(getattr(given, name)).tobytes()
    points, left_out = common_points(initial, {})
    assert left_out == []
    for wanted, point in zip(EXACT.common, points, strict=True):
        assert point.name == wanted.name
        assert point.object_mm.tobytes() == wanted.object_mm.tobytes()
        assert not point.covariance_mm2.any()


def test_a_single_pedicle_is_left_out() -> None:
    document = json.loads(json.dumps(DOCUMENT))
    document["vertebrae"][0]["pa"]["pedicle_left"] = None
    initial = InitialRadiographs.model_validate(document)
    assert landmarked_vertebra(initial.vertebrae[0]).pedicles_px is None
    assert landmarked_vertebra(initial.vertebrae[1]).pedicles_px is not None


def test_a_landmark_at_a_triad_takes_its_place_and_error() -> None:
    document = json.loads(json.dumps(DOCUMENT))
    for landmark, triad in zip(document["common"][:2], ("T9", "L1"), strict=True):
        landmark["object_mm"], landmark["triad"] = None, triad
    measured = pose(1)
    points, left_out = common_points(InitialRadiographs.model_validate(document), {"T9": measured})
    assert points[0].object_mm.tobytes() == measured.position_mm.tobytes()
    np.testing.assert_array_equal(points[0].covariance_mm2, measured.covariance[:3, :3])
    assert left_out == [EXACT.common[1].name]
    assert len(points) == len(EXACT.common) - 1


def test_a_fit_passes_through_json_to_the_last_bit() -> None:
    _, fit = initial_from_radiographs(PA, LATERAL, EXACT.vertebrae, EXACT.common)
    made = RadiographFit.of(fit, ["screw 9"])
    again = RadiographFit.model_validate_json(made.model_dump_json())
    assert again == made
    assert np.array(again.rotation).tobytes() == fit.similarity.transform.rotation.tobytes()
    assert again.scale == fit.similarity.transform.scale
    assert [point.name for point in again.residuals] == [point.name for point in EXACT.common]
    assert again.residuals[2].distance_mm == pytest.approx(np.linalg.norm(again.residuals[2].residual_mm))
    assert again.rms_mm**2 == pytest.approx(np.mean([point.distance_mm**2 for point in again.residuals]))
    assert again.left_out == ["screw 9"]


RADIOGRAPH: dict[str, Any] = {
    "id": "r",
    "surgery_id": "s",
    "view": "pa",
    "positive_on": "left",
    "pixel_spacing_mm": [0.2, 0.18],
    "spacing_source": "given",
    "image": {"sha256": "0", "media_type": "image/png", "width_px": 3, "height_px": 2, "size_bytes": 70},
    "created_at": "2026-11-27T09:00:00Z",
}


def test_a_radiograph_passes_through_json() -> None:
    made = Radiograph.model_validate_json(json.dumps(RADIOGRAPH))
    assert json.loads(made.model_dump_json()) == RADIOGRAPH


@pytest.mark.parametrize(
    "wrong",
    [
        {"view": "ap"},
        {"positive_on": "up"},
        {"pixel_spacing_mm": [0.2]},
        {"spacing_source": "guess"},
        {"patient": "x"},
    ],
)
def test_a_radiograph_of_another_form_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Radiograph.model_validate_json(json.dumps({**RADIOGRAPH, **wrong}))


def test_a_fit_is_tried_with_or_without_a_stage() -> None:
    assert NewRadiographFit.model_validate({"initial": DOCUMENT}).stage is None
    assert NewRadiographFit.model_validate({"initial": DOCUMENT, "stage": "PRE"}).stage == "PRE"
