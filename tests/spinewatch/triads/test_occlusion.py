from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Float, Int
from spinewatch.detection.features import HIDDEN
from spinewatch.imaging.frame import Side
from spinewatch.markers import FLAT_10_14_18, TriadModel, scaled
from spinewatch.matching.identification import IdentificationParameters
from spinewatch.matching.points import MatchingParameters, match_features
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig, table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.occlusion import FreeFeatures, OcclusionParameters, occluded_candidates
from spinewatch.triads.pose import Pose
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads

RIG, PARAMETERS = large_rig(), SearchParameters()
BODY = TriadModel(
    "body", ("A", "B", "C", "D"), np.array([[18.0, 0, 0], [0, -15, 0], [-13, 0, 0], [-4, 18, 8]]), 8.0
)


def distances(search: TriadSearch, poses: tuple[Pose, ...]) -> Float:
    found = np.array([t.position_mm for t in search.triads]).reshape(-1, 3)
    return np.asarray(np.linalg.norm(found[:, None] - [p.position_mm for p in poses], axis=-1))


def free_features(observed: Observation) -> FreeFeatures:
    """All features, none of which a triad uses."""
    points = match_features(observed.left, observed.right, RIG, 8.0, MatchingParameters())
    rays = observed.left.rays(RIG.left, 0.1), observed.right.rays(RIG.right, 0.1)
    return FreeFeatures(points, rays, (np.arange(len(rays[0])), np.arange(len(rays[1]))))


def occluded(
    observed: Observation,
    missing: int | None = 1,
    identification: IdentificationParameters | None = None,
    parameters: OcclusionParameters | None = None,
    model: TriadModel = FLAT_10_14_18,
) -> TriadCandidates:
    return occluded_candidates(
        free_features(observed),
        RIG,
        [model],
        identification or IdentificationParameters(),
        SelectionParameters(),
        parameters or OcclusionParameters(),
        missing,
    )


def balls_of(candidates: TriadCandidates, observed: Observation, index: int) -> tuple[Int, Int]:
    """The true balls of the features of a candidate, -2 where hidden."""
    sides = ((candidates.left, observed.left_ball), (candidates.right, observed.right_ball))
    left, right = (np.where(features[index] == HIDDEN, -2, ball[features[index]]) for features, ball in sides)
    return left, right


@pytest.mark.parametrize("ball", range(3))
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_triad_with_one_hidden_ball_image_is_the_most_likely_candidate(ball: int, side: Side) -> None:
    rng = np.random.default_rng([ball, len(side)])
    poses = random_spine(rng, 1)
    observed = observe(RIG, poses, rng, FeatureNoise(0.1, false_features=10), hidden=[(ball, side)])
    found = occluded(observed)
    best = int(np.argmax(found.log_odds))
    hidden = [-2 if k == ball else k for k in range(3)]
    left, right = balls_of(found, observed, best)
    assert left.tolist() == [*(hidden if side == "left" else range(3)), -2]
    assert right.tolist() == [*(hidden if side == "right" else range(3)), -2]


def test_each_set_of_features_is_listed_once_and_not_too_many() -> None:
    rng = np.random.default_rng(5)
    observed = observe(RIG, random_spine(rng, 2), rng, FeatureNoise(0.2, false_features=60))
    found = occluded(observed)
    features = np.concatenate([found.left, found.right], axis=1)
    assert len(np.unique(features, axis=0)) == len(found)
    few = occluded(observed, parameters=OcclusionParameters(max_candidates=3, max_pairs=2))
    assert 0 < len(few) <= 5


def test_pairs_of_balls_need_a_number_of_missing_triads() -> None:
    rng = np.random.default_rng(6)
    observed = observe(RIG, random_spine(rng, 1), rng, FeatureNoise(0.05), dropped=[1])
    assert len(occluded(observed, missing=None)) == 0
    assert len(occluded(observed, missing=1)) > 0


def test_the_deviation_of_markers_as_made_is_the_callers() -> None:
    rng = np.random.default_rng(7)
    larger = scaled(FLAT_10_14_18, 1.08)  # balls XX and MX 2.2 mm too far apart
    observed = observe(RIG, random_spine(rng, 1), rng, FeatureNoise(0.05), dropped=[1], models=[larger])
    exact, loose = (
        occluded(observed, identification=IdentificationParameters(model_sd_mm=sd)) for sd in (0.2, 2.0)
    )
    assert len(exact) == 0
    assert len(loose) > 0


def test_markers_of_four_balls_are_identified_with_the_callers_parameters() -> None:
    rng = np.random.default_rng(8)
    observed = observe(RIG, random_spine(rng, 1), rng, FeatureNoise(0.1), dropped=[2], models=[BODY])
    usual, impossible = (
        occluded(observed, identification=IdentificationParameters(tolerance_mm=tolerance), model=BODY)
        for tolerance in (5.0, 1e-4)
    )
    assert len(usual) > 0
    assert len(impossible) == 0


def test_the_sampling_of_the_circle_changes_the_pose_hardly() -> None:
    rng = np.random.default_rng(9)
    observed = observe(RIG, random_spine(rng, 1), rng, FeatureNoise(0.1), hidden=[(0, "left")])
    coarse, fine = (occluded(observed, parameters=OcclusionParameters(n_circle_points=n)) for n in (24, 96))
    best = [found.take([int(np.argmax(found.log_odds))]) for found in (coarse, fine)]
    assert np.allclose(best[0].origin_mm, best[1].origin_mm, atol=0.05)


def test_without_the_search_for_hidden_balls_only_full_views_are_found() -> None:
    rng = np.random.default_rng(10)
    observed = observe(RIG, random_spine(rng, 3), rng, FeatureNoise(0.1), hidden=[(4, "left")])
    off = replace(PARAMETERS, occlusion=OcclusionParameters(enabled=False))
    found = match_triads(observed.left, observed.right, RIG, off, expected=3, axis="x")
    assert len(found.triads) == 2
    found = match_triads(observed.left, observed.right, RIG, PARAMETERS, expected=3, axis="x")
    assert len(found.triads) == 3


def test_a_hidden_ball_is_flagged_and_its_triad_less_certain() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(11)
    poses = random_spine(rng, 4)
    whole = observe(rig, poses, np.random.default_rng(1), FeatureNoise(0.05))
    observed = observe(rig, poses, np.random.default_rng(1), FeatureNoise(0.05), hidden=[(4, "right")])
    (certain, search) = (
        match_triads(s.left, s.right, rig, PARAMETERS, expected=4, axis="x") for s in (whole, observed)
    )
    assert [flag.code for flag in search.flags] == ["ball-occluded"]
    assert "ball YY is hidden in the right image" in search.flags[0].detail
    ball = search.triads[1].balls["YY"]
    assert ball.right_px is None
    assert ball.left_px is not None
    assert ball.parallax_mm is None
    truth = poses[1].position_mm + FLAT_10_14_18.coordinates_mm[1] @ poses[1].rotation.T
    assert (np.abs(ball.position_mm - truth) < 4 * np.sqrt(np.diag(ball.covariance_mm2))).all()
    before, after = certain.triads[1].pose, search.triads[1].pose
    assert before is not None
    assert after is not None
    assert after.rotation_sd_deg.max() > before.rotation_sd_deg.max()


def test_a_ball_hidden_in_both_views_leaves_its_triad_without_a_pose() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(12)
    poses = random_spine(rng, 4)
    observed = observe(rig, poses, rng, FeatureNoise(0.05), dropped=[4])
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4, axis="x")
    assert [flag.code for flag in search.flags] == ["triad-incomplete", "triad-count-low"]
    incomplete = search.triads[1]
    assert incomplete.pose is None
    assert incomplete.reason
    assert list(incomplete.balls) == ["XX", "MX"]


def test_a_marker_of_four_balls_does_without_one() -> None:
    rig, rng = large_rig(), np.random.default_rng(8)
    poses = random_spine(rng, 3, spacing_mm=60)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=10), models=[BODY] * 3, dropped=[6])
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=3, axis="x", models=[BODY])
    assert [flag.code for flag in search.flags] == ["ball-occluded"]
    assert (distances(search, poses).min(axis=1) < 1).all()
    assert search.triads[1].balls["C"].hidden_in == ("left", "right")
