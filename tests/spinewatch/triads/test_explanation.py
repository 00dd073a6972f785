from collections import Counter
from dataclasses import replace

import numpy as np

from spinewatch.detection.features import HIDDEN
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.exclusion import RemovedTriad
from spinewatch.matching.rejections import FeatureRejection, TriadRejection
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.explanation import Explanation, explain
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads

RIG, P, MODELS = large_rig(), SearchParameters(), [FLAT_10_14_18]


def seen(seed: int = 1, triads: int = 4, false: int = 60, **options: object) -> Observation:
    rng = np.random.default_rng(seed)
    return observe(RIG, random_spine(rng, triads), rng, FeatureNoise(0.1, false_features=false), **options)  # type: ignore[arg-type]


def found(
    images: Observation, expected: int | None, removed: tuple[RemovedTriad, ...] = (), p: SearchParameters = P
) -> tuple[TriadSearch, Explanation]:
    search = match_triads(images.left, images.right, RIG, p, expected=expected, removed=removed)
    pair = images.left, images.right
    return search, explain(search, pair, RIG, p, MODELS, expected=expected, removed=removed)


def test_every_candidate_has_one_verdict_and_every_feature_a_use() -> None:
    images = seen()
    search, explanation = found(images, 4)
    chosen = [verdict for verdict in explanation.verdicts if verdict.reason is None]
    assert len(chosen) == len(search.triads) == 4
    assert all(verdict.reason is not None for verdict in explanation.verdicts[4:])
    for verdict, left in zip(chosen, search.selected.left, strict=True):
        assert verdict.left.tolist() == left[left != HIDDEN].tolist()
    inside = sum(map(len, search.triplets))
    early = (TriadRejection.FEATURE_TWICE, TriadRejection.DISTANCES, TriadRejection.MIRRORED)
    assert sum(verdict.reason not in early for verdict in explanation.verdicts) == inside
    for side, features in zip(explanation.uses, (images.left, images.right), strict=True):
        assert len(side) == len(features)
        assert sum(use.triad is not None for use in side) == 12
        assert all((use.triad is None) == (use.reason is not None) for use in side)


def test_rivals_are_rejected_by_the_heuristics() -> None:
    counts: Counter[TriadRejection | None] = Counter()
    for seed in range(6):
        _, explanation = found(seen(seed, false=120), 4)
        for verdict in explanation.verdicts:
            counts[verdict.reason] += 1
            shares = verdict.reason in (TriadRejection.POINT_TAKEN, TriadRejection.FEATURE_TAKEN)
            assert (verdict.rival is not None) == (shares or verdict.reason is TriadRejection.TOO_NEAR)
            if shares:
                rival = explanation.verdicts[verdict.rival or 0]
                assert set(verdict.left) & set(rival.left) or set(verdict.right) & set(rival.right)
            if verdict.reason is TriadRejection.FEATURE_TWICE:
                assert len(set(verdict.left)) < 3 or len(set(verdict.right)) < 3
    assert counts[TriadRejection.FEATURE_TWICE]
    assert counts[TriadRejection.DISTANCES]
    assert counts[TriadRejection.FEATURE_TAKEN] or counts[TriadRejection.POINT_TAKEN]


def test_a_triad_beyond_the_number_is_counted_out() -> None:
    images = seen(3, false=0)
    few = replace(P, selection=replace(P.selection, surplus_log_odds=1e6))
    _, explanation = found(images, 3, p=few)
    reasons = Counter(verdict.reason for verdict in explanation.verdicts)
    assert reasons[None] == 3
    assert reasons[TriadRejection.COUNT] >= 1


def test_a_triad_that_a_person_removed_says_so() -> None:
    images = seen(false=0)
    search, _ = found(images, 4)
    first = search.triads[0]
    left, right = ([getattr(ball, side) for ball in first.balls.values()] for side in ("left_px", "right_px"))
    gone = RemovedTriad(first.position_mm, np.array(left), np.array(right))
    after, explanation = found(images, 4, (gone,))
    assert len(after.triads) == 3
    assert TriadRejection.REMOVED in [verdict.reason for verdict in explanation.verdicts]


def test_a_triad_with_a_hidden_ball_is_among_the_chosen() -> None:
    images = seen(false=0, hidden=[(1, "right")])
    _, explanation = found(images, 4)
    chosen = [verdict for verdict in explanation.verdicts if verdict.reason is None]
    assert len(chosen) == 4
    assert sum((verdict.right == HIDDEN).sum() for verdict in chosen) == 1


def test_features_without_a_partner_are_told_from_those_in_no_triad() -> None:
    _, explanation = found(seen(5, false=60), 4)
    reasons = Counter(use.reason for side in explanation.uses for use in side)
    assert reasons[FeatureRejection.NO_PARTNER]
    assert reasons[FeatureRejection.NO_TRIAD]


def test_images_without_features_have_nothing_to_explain() -> None:
    images = seen(triads=1, false=0)
    nothing = replace(images, left=images.left.take(np.arange(0)), right=images.right.take(np.arange(0)))
    _, explanation = found(nothing, 1)
    assert (explanation.verdicts, explanation.uses) == ((), ((), ()))
