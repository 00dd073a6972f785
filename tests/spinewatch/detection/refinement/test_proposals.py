"""Proposals keep the order of the candidates; their scores and sizes."""

import numpy as np
import pytest

from spinewatch.detection.candidates.search import DetectionParameters, detect
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.networks import BallEstimates
from spinewatch.detection.refinement.proposals import NominalView, Proposals, ball_scores, propose, size_ratio
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
P = CentreParameters()


def estimates(log_odds: float, log_size: list[float]) -> BallEstimates:
    n = len(log_size)
    return BallEstimates(
        np.full(n, log_odds),
        np.zeros((n, 2)),
        np.tile(np.eye(2), (n, 1, 1)),
        np.ones(n),
        np.array(log_size),
        np.zeros((n, 2)),
        np.ones(n),
    )


def proposals(candidates: Features | None, factor: float = 1.0) -> Proposals:
    frame = Frame(decode_image((D1 / "PRE" / "left.png").read_bytes()), "left")
    ball_px = (9.1 * factor, 10.8 * factor)
    view = NominalView(parse_rig((D1 / "rig.json").read_bytes()).left, ball_px, np.array([0.25, 0.0]))
    if candidates is None:
        candidates = detect(frame, ball_px, DetectionParameters()).features
    return propose(view, frame, candidates, default_networks(), P)


def test_the_size_of_balls_is_the_median_of_probable_ones_and_the_nominal_one_of_few() -> None:
    sizes = [0.1, 0.2, 0.2, 0.9]
    assert size_ratio(estimates(5.0, sizes), P) == pytest.approx(np.exp(0.2))
    assert size_ratio(estimates(5.0, sizes[:3]), P) == 1
    assert size_ratio(estimates(3.0, sizes), P) == 1


def test_scores_grow_with_odds_and_similarity_from_0_to_1() -> None:
    similarity = np.array([0.0, 0.5, 1.0])
    low, high = (ball_scores(estimates(odds, [0.0] * 3), similarity, P) for odds in (-99.0, 99.0))
    assert low[0] == 0
    assert high[2] == 1
    assert np.all(low < high)
    assert np.all(np.diff([low, high], axis=1) > 0)


def test_proposals_have_the_order_of_the_candidates() -> None:
    found = proposals(None)
    some = Features.with_sigma(np.array([[310.0, 222.0], [200.0, 150.0]]), np.array([0.9, 0.8]), 0.3)
    there, back = (proposals(features) for features in (some, some.take([1, 0])))
    assert len(found.score) == len(found.centre) == len(found.similarity)
    assert there.score == pytest.approx(back.score[::-1])
    assert there.centre == pytest.approx(back.centre[::-1])


def test_larger_balls_are_nearer_and_see_the_lamp_at_a_larger_angle() -> None:
    larger, smaller = (
        (found, found.ball_px / np.multiply((9.1, 10.8), factor))
        for factor in (0.9, 1.1)
        for found in (proposals(None, factor),)
    )
    assert np.all(larger[1] > smaller[1])
    for found, ratio in (larger, smaller):
        assert found.lamp == pytest.approx(ratio * (0.25, 0.0))


def test_without_candidates_the_nominal_size_holds() -> None:
    found = proposals(Features.empty())
    assert len(found.score) == 0
    assert found.ball_px.tolist() == [9.1, 10.8]
