"""The stage document says what the measurement says, in JSON's own types."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from contract.stage_documents import features_document, stage_document
from spinewatch.detection.candidates.search import Detection
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.imaging.exposure import Exposure
from spinewatch.matching.rig_check import RigCheck
from spinewatch.pipeline import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose


def measurement() -> StageMeasurement:
    random = np.random.default_rng(5)
    A = random.normal(size=(6, 6))
    pose = Pose(np.array([1.0, 2, 3]), rotation_from_vector(np.array([0.1, -0.2, 0.3])), A @ A.T)
    ball = Ball(
        np.array([4.0, 5, 6]), np.diag([0.04, 0.09, 0.25]), np.array([7.5, 8]), np.array([9.0, 1]), 0.125
    )
    triad = MeasuredTriad("flat-10-14-18", {"XX": ball, "YY": ball, "MX": ball}, pose, 0.5)
    covariance = np.array([[[0.16, 0.01], [0.01, 0.36]]])
    features = Features(np.array([[10.0, 20]]), np.array([0.75]), covariance, np.array([0.5]))
    left = Detection(features, SurgicalField(1, 2, 3, 4), Exposure.NORMAL, ())
    right = Detection(Features.empty(), SurgicalField(5, 6, 7, 8), Exposure.GLARE, ())
    triads = (LabelledTriad("L1", None, triad), LabelledTriad(None, "no gap decides", triad))
    return StageMeasurement(left, right, triads, (Flag("triad-count-low", "1 of 2"),))


def test_document_is_json_and_complete() -> None:
    document = stage_document(measurement())
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["features"] == {
        "left": [{"x": 10, "y": 20, "score": 0.75, "sd_px": [0.4, 0.6], "visible_fraction": 0.5}],
        "right": [],
    }
    assert document["fields"] == {"left": [1, 2, 3, 4], "right": [5, 6, 7, 8]}
    assert document["exposure"] == {"left": "normal", "right": "glare"}
    assert document["flags"] == [{"code": "triad-count-low", "detail": "1 of 2"}]
    first, second = document["triads"]
    assert (first["label"], first["label_reason"]) == ("L1", None)
    assert (second["label"], second["label_reason"]) == (None, "no gap decides")


def test_features_that_nobody_looked_at_have_no_visible_fraction() -> None:
    (entry,) = features_document(Features.with_sigma(np.array([[1.0, 2]]), np.array([0.5]), 0.3))
    assert entry["visible_fraction"] is None


def test_what_the_balls_say_about_the_rig_is_told() -> None:
    assert stage_document(measurement())["rig_check"] is None
    turn, sd = np.array([0.02, 0, 0]), np.array([0.04, 0.1, 0.03])
    check = RigCheck(12, 0.25, 20.0, 4, 0.0005, True, turn, sd, turn * 10, sd * 10)
    assert stage_document(replace(measurement(), rig_check=check))["rig_check"] == {
        "balls": 12,
        "rms_px": 0.25,
        "chance": 0.0005,
        "drifted": True,
        "turn_deg": turn.tolist(),
        "turn_sd_deg": sd.tolist(),
        "shift_mm": (turn * 10).tolist(),
        "shift_sd_mm": (sd * 10).tolist(),
    }


def test_triad_carries_pose_and_uncertainty() -> None:
    measured = measurement()
    triad, pose = stage_document(measured)["triads"][0], measured.triads[0].triad.pose
    assert pose is not None
    assert triad["position_mm"] == [1, 2, 3]
    np.testing.assert_array_equal(triad["rotation"], pose.rotation)
    np.testing.assert_array_equal(triad["covariance"], pose.covariance)
    np.testing.assert_allclose(np.cos(np.radians(triad["angles_deg"])), triad["normal"])
    np.testing.assert_allclose(np.square(triad["position_sd_mm"]), np.diag(pose.covariance)[:3])
    assert triad["balls"]["YY"] == {
        "position_mm": [4, 5, 6],
        "sd_mm": pytest.approx([0.2, 0.3, 0.5]),
        "left": [7.5, 8],
        "right": [9, 1],
        "parallax_mm": 0.125,
    }
    assert (triad["model"], triad["error_mm"]) == ("flat-10-14-18", 0.5)


def test_what_is_hidden_is_null() -> None:
    good = measurement()
    triad = good.triads[0].triad
    ball = replace(triad.balls["YY"], right_px=None, parallax_mm=None)
    hidden = replace(triad, balls={"YY": ball}, pose=None, reason="not determined")
    document = stage_document(replace(good, triads=(LabelledTriad("L1", None, hidden),)))["triads"][0]
    assert document["reason"] == "not determined"
    assert document["position_mm"] is document["rotation"] is document["covariance"] is None
    assert document["balls"]["YY"]["left"] == [7.5, 8]
    assert document["balls"]["YY"]["right"] is document["balls"]["YY"]["parallax_mm"] is None


def test_number_that_is_not_finite_is_refused() -> None:
    good = measurement()
    triad = replace(good.triads[0].triad, error_mm=float("nan"))
    with pytest.raises(ValueError, match="not finite"):
        stage_document(replace(good, triads=(LabelledTriad("L1", None, triad),)))
