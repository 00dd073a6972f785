"""Centres on images that show no balls, and what scores, shared sizes and both orientations do to them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.detection.candidates.search import DetectionParameters, detect
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.detection.refinement.centres import measure_shared, refine
from spinewatch.detection.refinement.look import LookParameters
from spinewatch.detection.refinement.network_file import default_networks
from spinewatch.detection.refinement.proposals import NominalView, propose
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
BALL = (9.1, 10.8)
LAMP = np.array([0.25, 0.0])


@pytest.fixture(scope="module")
def rig() -> Rig:
    return parse_rig((D1 / "rig.json").read_bytes())


def refined(
    view: NominalView,
    image: Pixels,
    candidates: Features,
    p: CentreParameters | None = None,
    min_score: float = 0.0,
) -> Features:
    """Refine a left view beside a right one without candidates."""
    p, networks = p or CentreParameters(), default_networks()
    nothing = Frame(np.full((9, 9), 7, np.uint8), "right")
    left = propose(view, Frame(image, "left"), candidates, networks, p)
    right = propose(view, nothing, Features.empty(), networks, p)
    found, none = refine((left, right), p, min_score=min_score)
    assert len(none.features) == len(none.discarded) == 0
    return found.features


def refined_at(image: NDArray[np.uint8], xy: NDArray[np.float64], rig: Rig) -> Features:
    candidates = Features.with_sigma(xy, np.linspace(0.9, 0.5, len(xy)), 0.3)
    return refined(NominalView(rig.left, BALL, LAMP), image, candidates)


def test_an_even_image_has_no_balls_and_no_candidates_remain_none(rig: Rig) -> None:
    plain = np.full((416, 568), 120, np.uint8)
    some = refined_at(plain, np.random.default_rng(1).uniform(100, 300, (12, 2)), rig)
    assert np.isfinite(some.xy_px).all()
    assert some.score.max() < 0.644  # odds of a ball below 1 to 30; templates alone would give 0.9
    assert len(refined_at(plain, np.empty((0, 2)), rig)) == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 500), (5, 5), (60, 80)])
@pytest.mark.parametrize("ball", [(0.5, 0.6), (2.0, 2.4), BALL, (200.0, 240.0)])
def test_no_image_and_no_size_of_ball_stops_detection(
    shape: tuple[int, int], ball: tuple[float, float], rig: Rig
) -> None:
    image = np.random.default_rng(3).integers(0, 65535, shape).astype(np.uint16)
    found = detect(Frame(image, "left"), ball, DetectionParameters())
    assert len(found.features) or found.flags
    features = refined(NominalView(rig.left, ball, LAMP), image, found.features)
    assert np.isfinite(features.xy_px).all()
    assert np.all(np.linalg.eigvalsh(features.covariance_px2) > 0)


@pytest.fixture(scope="module")
def sample(rig: Rig) -> tuple[NominalView, Pixels, Features]:
    image = decode_image((D1 / "PRE" / "left.png").read_bytes())
    found = detect(Frame(image, "left"), BALL, DetectionParameters())
    return NominalView(rig.left, BALL, LAMP), image, found.features


def test_the_size_of_balls_is_measured(sample: tuple[NominalView, Pixels, Features]) -> None:
    view, image, candidates = sample
    sizes = []
    for factor in (0.95, 1.05):
        wrong = replace(view, ball_px=(factor * BALL[0], factor * BALL[1]))
        proposals = propose(wrong, Frame(image, "left"), candidates, default_networks(), CentreParameters())
        sizes.append(measure_shared(proposals, proposals.networks[0], CentreParameters()).ball_px)
    assert sizes[0] == pytest.approx(sizes[1], rel=0.03)


def test_the_second_orientation_lowers_the_covariance(sample: tuple[NominalView, Pixels, Features]) -> None:
    with_it, without = (
        refined(
            *sample, CentreParameters(n_rotated=n, model_sd=0.0, look=LookParameters(max_sd=0.0))
        ).covariance_px2[:12]
        for n in (24, 0)
    )
    ratio = np.linalg.det(with_it) / np.linalg.det(without)
    assert np.median(ratio) == pytest.approx(0.9**2, abs=0.15)


def test_features_of_a_low_score_are_not_refined_in_all_orientations(
    sample: tuple[NominalView, Pixels, Features],
) -> None:
    every, upright, some = (
        refined(*sample, CentreParameters(look=LookParameters(max_sd=0.0)), least)
        for least in (0.0, 1.0, 0.6)
    )
    high, low = every.score >= 0.6, some.score < 0.6
    assert 0 < high.sum() < len(every)
    assert np.array_equal(some.xy_px[: high.sum()], every.xy_px[high])
    for features in (some.take(np.flatnonzero(low)), upright):
        distance = np.linalg.norm(features.xy_px[:, None] - upright.xy_px, axis=2).min(axis=1)
        assert np.all(distance == 0)


def test_the_network_of_all_looks_counts_when_the_look_is_not_usual(
    sample: tuple[NominalView, Pixels, Features],
) -> None:
    view, image, candidates = sample
    side = propose(view, Frame(image, "left"), candidates, default_networks(), CentreParameters())

    def centres(look: LookParameters, *, any_look: bool) -> NDArray[np.float64]:
        found, _ = refine((side, side), CentreParameters(look=look), any_look=any_look)
        return found.features.xy_px[:12]

    usual, unusual = LookParameters(), LookParameters(max_sd=0.0)
    of_all = centres(usual, any_look=True)
    assert np.array_equal(centres(unusual, any_look=False), of_all)
    apart = np.linalg.norm(centres(usual, any_look=False)[:, None] - of_all, axis=2).min(axis=1)
    assert 0 < np.median(apart) < 0.1


def test_three_orientations_count_when_the_look_is_not_usual(
    sample: tuple[NominalView, Pixels, Features],
) -> None:
    unusual = LookParameters(max_sd=0.0)
    of = {
        rho: refined(*sample, CentreParameters(rotation_correlation=rho, model_sd=0.0, look=unusual))
        for rho in (0.0, 1.0)
    }
    ratio = of[0.0].covariance_px2[:12, 0, 0] / of[1.0].covariance_px2[:12, 0, 0]
    assert ratio == pytest.approx(1 / 3)


@given(st.integers(1, 12))
def test_counts_limit_what_is_returned(count: int) -> None:
    rng = np.random.default_rng(count)
    image = rng.integers(0, 255, (80, 90)).astype(np.uint8)
    candidates = Features.with_sigma(rng.uniform(10, 70, (20, 2)), np.linspace(0.9, 0.5, 20), 0.3)
    view = NominalView(parse_rig((D1 / "rig.json").read_bytes()).left, BALL, LAMP)
    found = refined(view, image, candidates, CentreParameters(n_kept=count))
    assert 1 <= len(found) <= count
    assert np.all(np.diff(found.score) <= 0)


def test_candidates_of_one_ball_become_one_feature(sample: tuple[NominalView, Pixels, Features]) -> None:
    view, image, candidates = sample
    best = candidates.take(np.arange(5))
    twice = Features(
        np.concatenate([best.xy_px, best.xy_px + 0.6]),
        np.concatenate([best.score, best.score]),
        np.concatenate([best.covariance_px2, best.covariance_px2]),
    )
    assert len(refined(view, image, twice)) == len(refined(view, image, best))
