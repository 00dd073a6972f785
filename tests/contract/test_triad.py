from dataclasses import replace

import numpy as np
import pytest

from contract.triad import Ball, Triad
from spinewatch.detection.placed_centres import PlacedCentre
from spinewatch.triads.labels import LabelledTriad
from tests.contract.results import ball, labelled


def test_a_triad_has_its_label_pose_and_balls() -> None:
    given = labelled()
    document = Triad.of(given).model_dump(mode="json")
    pose = given.triad.pose
    assert pose is not None
    np.testing.assert_array_equal(document["rotation"], pose.rotation)
    np.testing.assert_array_equal(document["covariance"], pose.covariance)
    assert (document["label"], document["label_reason"], document["reason"]) == ("L1", None, None)
    assert (document["model"], document["error_mm"]) == ("flat-10-14-18", 0.5)
    assert set(document["balls"]) == {"XX", "YY", "MX"}


def test_a_ball_has_its_standard_deviations() -> None:
    assert Ball.of(ball()).model_dump() == {
        "position_mm": [4.0, 5.0, 6.0],
        "sd_mm": pytest.approx([0.2, 0.3, 0.5]),
        "left": [7.5, 8.0],
        "right": [9.0, 1.0],
        "parallax_mm": 0.125,
        "manual": [],
        "placed": [],
    }


def test_a_placed_centre_tells_its_distance_from_what_was_detected() -> None:
    on = PlacedCentre((7.5, 8.0), (7.0, 8.0), 0.5, 0.9)
    given = replace(
        ball(), manual_in=("left", "right"), placed={"left": on, "right": PlacedCentre((9.0, 1.0))}
    )
    assert Ball.of(given).model_dump()["placed"] == [
        {"side": "left", "feature": [7.0, 8.0], "distance_px": 0.5, "distance_sd": 0.9},
        {"side": "right", "feature": None, "distance_px": None, "distance_sd": None},
    ]


def test_what_is_hidden_is_null() -> None:
    hidden = Ball.of(replace(ball(), right_px=None, parallax_mm=None))
    assert (hidden.left, hidden.right, hidden.parallax_mm) == ([7.5, 8.0], None, None)
    triad = Triad.of(LabelledTriad("L1", None, replace(labelled().triad, pose=None, reason="not determined")))
    assert triad.reason == "not determined"
    assert (triad.position_mm, triad.rotation, triad.covariance) == (None, None, None)
    assert triad.pose() is None


def test_a_number_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        Triad.of(LabelledTriad("L1", None, replace(labelled().triad, error_mm=float("nan"))))
