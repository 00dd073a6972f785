import numpy as np

from spinewatch.detection.features import HIDDEN
from spinewatch.matching.triad_candidates import MAX_BALLS, TriadCandidates, pad_features, share_features


def candidates(features: list[list[int]], log_odds: list[float] | None = None) -> TriadCandidates:
    n = len(features)
    index = pad_features(np.array(features))
    odds = np.zeros(n) if log_odds is None else np.array(log_odds)
    return TriadCandidates(
        np.zeros(n, dtype=int), np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)), odds, index, index
    )


def test_hidden_balls_are_not_shared() -> None:
    found = candidates([[0, 1, HIDDEN], [2, 3, HIDDEN], [4, 3, 5]])
    assert share_features(found).tolist() == [
        [True, False, False],
        [False, True, True],
        [False, True, True],
    ]


def test_features_are_padded_with_hidden_balls() -> None:
    assert pad_features(np.array([[7, 8, 9]])).tolist() == [[7, 8, 9, *[HIDDEN] * (MAX_BALLS - 3)]]


def test_candidates_are_taken_and_joined_in_order() -> None:
    some = candidates([[0, 1, 2], [3, 4, 5]], [1.0, 2.0])
    joined = TriadCandidates.concatenate([TriadCandidates.empty(), some.take([1]), some])
    assert joined.log_odds.tolist() == [2.0, 1.0, 2.0]
    assert joined.left[:, 0].tolist() == [3, 0, 3]
    assert len(TriadCandidates.empty()) == 0
