import numpy as np

from spinewatch.detection.features import Features
from spinewatch.detection.manual import CentreEdit, edit_features
from spinewatch.detection.refinement.centre_parameters import CentreParameters

FOUND = Features.with_sigma(np.array([[10.0, 20], [30, 40], [50, 60]]), np.array([0.9, 0.7, 0.6]), 0.1)
BALL = (10.0, 12.0)
P = CentreParameters()


def edited(*edits: CentreEdit) -> Features:
    return edit_features(FOUND, edits, BALL, P)


def test_without_edits_nothing_changes() -> None:
    assert edited() is FOUND


def test_a_placed_centre_is_a_ball_with_the_deviation_of_one_that_nothing_confirms() -> None:
    after = edited(CentreEdit(None, (70.0, 80.0)))
    assert after.xy_px[0].tolist() == [70, 80]
    assert (after.score[0], after.is_manual.tolist()) == (1.0, [True, False, False, False])
    np.testing.assert_allclose(
        np.sqrt(np.diag(after.covariance_px2[0])), P.placed.unconfirmed_sd * np.array(BALL) / 2, rtol=1e-12
    )
    np.testing.assert_array_equal(after.covariance_px2[1], FOUND.covariance_px2[0])


def test_a_centre_takes_the_place_of_features_of_the_same_ball() -> None:
    after = edited(CentreEdit(None, (31.0, 40.0)))
    assert after.xy_px.tolist() == [[31, 40], [10, 20], [50, 60]]


def test_a_centre_on_what_was_detected_has_the_deviation_of_a_person() -> None:
    for after in (edited(CentreEdit(1, (31.0, 40.0))), edited(CentreEdit(None, (30.0, 41.0)))):
        deviations = np.sqrt(np.diag(after.covariance_px2[0]))
        np.testing.assert_allclose(deviations, P.manual_sd * np.array(BALL) / 2, rtol=1e-12)


def test_a_feature_that_an_earlier_edit_took_away_still_tells_how_far_a_centre_is() -> None:
    without = edited(CentreEdit(1, None))
    after = edit_features(without, [CentreEdit(None, (38.0, 40.0))], BALL, P, FOUND)
    assert np.sqrt(after.covariance_px2[0, 0, 0]) > 8
    assert np.sqrt(after.covariance_px2[0, 1, 1]) < 1


def test_moved_and_removed_features_are_gone() -> None:
    after = edited(CentreEdit(0, (90.0, 90.0)), CentreEdit(2, None))
    assert after.xy_px.tolist() == [[90, 90], [30, 40]]


def test_edits_of_edits_keep_what_was_placed() -> None:
    once = edited(CentreEdit(None, (70.0, 80.0)))
    twice = edit_features(once, [CentreEdit(1, None)], BALL, P)
    assert twice.is_manual.tolist() == [True, False, False]
