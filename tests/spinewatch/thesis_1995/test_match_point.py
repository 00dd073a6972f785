import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.detection.features import Features
from spinewatch.imaging.decoding import decode_image
from spinewatch.markers import FLAT_10_14_18
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.thesis_1995.candidate_sets import CandidateSetParameters
from spinewatch.thesis_1995.match_point import MatchPoint, MatchPointParameters, fitting_triplets, match_point
from tests.paths import SAMPLES

UNREFINED = MatchPointParameters(sets=CandidateSetParameters(refine=False))
LABELS = ("L1", "T11", "T9", "T7")


def from_true_centres(
    stage: str, parameters: MatchPointParameters
) -> tuple[MatchPoint, dict[str, np.ndarray]]:
    folder = SAMPLES / "D1" / stage
    truth = json.loads((folder / "truth.json").read_text())
    rig = parse_rig((SAMPLES / "D1" / "rig.json").read_bytes())
    balls = [ball for triad in truth["triads"] for ball in triad["balls"].values()]
    left, right = (
        Features.with_sigma(
            np.array([ball[side]["center_px"] for ball in balls if ball[side]["visible"]]),
            np.ones(sum(ball[side]["visible"] for ball in balls)),
            0.1,
        )
        for side in ("left", "right")
    )
    images = tuple(decode_image((folder / f"{side}.png").read_bytes()) for side in ("left", "right"))
    found = match_point(left, right, rig, LABELS, parameters, images=images)  # type: ignore[arg-type]
    return found, {triad["vertebra"]: np.array(triad["P_mm"]) for triad in truth["triads"]}


@pytest.mark.parametrize("stage", ["PRE", "INTER", "POST"])
def test_all_triads_of_the_sample_are_found_from_true_centres(stage: str) -> None:
    found, truth = from_true_centres(stage, UNREFINED)
    assert found.selection.complete
    assert [triad.label for triad in found.triads] == list(LABELS)
    for triad in found.triads:
        assert triad.label is not None
        assert triad.position_mm == pytest.approx(truth[triad.label], abs=0.3)


def test_refinement_discards_candidates_only() -> None:
    refined, _ = from_true_centres("PRE", MatchPointParameters())
    assert refined.refined.pairs.sum() < refined.sets.pairs.sum()
    assert not np.any(refined.refined.pairs & ~refined.sets.pairs)


def test_without_all_triads_none_has_a_label() -> None:
    balls_mm = FLAT_10_14_18.coordinates_mm + np.array([430.0, 390.0, 90.0])
    rig = parse_rig((SAMPLES / "D1" / "rig.json").read_bytes())
    left, right = (
        Features.with_sigma(camera.project(balls_mm), np.ones(3), 0.1) for camera in (rig.left, rig.right)
    )
    found = match_point(left, right, rig, ("L1", "T9"), UNREFINED)
    assert [triad.label for triad in found.triads] == [None]
    assert not found.selection.complete


def test_no_features_have_no_triads() -> None:
    rig = parse_rig((SAMPLES / "D1" / "rig.json").read_bytes())
    found = match_point(Features.empty(), Features.empty(), rig, LABELS, UNREFINED)
    assert found.triads == ()


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1.5))
def test_triplets_are_those_of_equation_5_16_by_exhaustive_search(seed: int, noise_mm: float) -> None:
    rng = np.random.default_rng(seed)
    points = np.concatenate(
        [FLAT_10_14_18.coordinates_mm + rng.normal(0, noise_mm, (3, 3)), rng.uniform(-25, 25, (6, 3))]
    )
    triplets, error = fitting_triplets(points, FLAT_10_14_18, 3.0)
    best: dict[frozenset[int], float] = {}
    for x in range(9):
        for y in range(9):
            for m in range(9):
                if len({x, y, m}) < 3:
                    continue
                d = np.linalg.norm(points[[x, x, y]] - points[[y, m, m]], axis=1) - FLAT_10_14_18.distances_mm
                if np.all(np.abs(d) < 3.0):
                    key = frozenset((x, y, m))
                    best[key] = min(best.get(key, np.inf), float(np.linalg.norm(d)))
    assert {frozenset(map(int, t)): pytest.approx(e) for t, e in zip(triplets, error, strict=True)} == best


def test_a_wider_tolerance_finds_more() -> None:
    narrow, _ = from_true_centres("INTER", replace(UNREFINED, distance_tolerance_mm=1.0))
    wide, _ = from_true_centres("INTER", replace(UNREFINED, distance_tolerance_mm=6.0))
    assert len(narrow.triplets) < len(wide.triplets)
