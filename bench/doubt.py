"""``python -m bench.doubt DIR...``: fit the chance that a triad is false, and show how well it holds.

Triads whose truth is known come from rendered pairs under the first DIR, as they are and made worse in one way each,
and with ball images removed or displaced. A logistic model is fitted to them and printed as `DoubtParameters`. The
table compares the chances of triads with their truth: in scenes that are left out of the fit, in the pairs under the
first DIR as they are, and in those under each further DIR, which take no part in the fit.

Run it again when the networks have been trained again, and write the printed weights into `spinewatch/triads/doubt.py`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from bench.tables import Grid
from bench.truth import Scene, TrueTriad, find_scenes, read_frames
from bench.worse_images import WORSE, worsened
from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.detection.detector import prepare_detector
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.imaging.frame import SIDES
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.epipolar import nominal_ranges_mm
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.parameters import Parameters
from spinewatch.triads.doubt import DoubtParameters, TriadEvidence, triad_evidence
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads
from spinewatch.triads.second_look import missing_ball_places

MODELS = (FLAT_10_14_18,)
WRONG_RADII = 0.8
"""A ball image farther than this from the ball's centre, in radii of a ball, is wrong."""

FALSE_MM = 2.5
"""A triad farther than this from every true one is false, whatever its ball images."""

SPOILT = 8
"""Number of times that the features of each training pair are spoilt."""

RIDGE = 0.02
"""Weight of the squares of the weights in the fit."""


@dataclass(frozen=True, eq=False)
class Sample:
    """Evidence of t triads, (t,) whether they are false, the group that is left out together, and the stages (t,)."""

    evidence: TriadEvidence
    false: Float
    group: tuple[str, ...]
    stage: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Truth:
    """True positions (n, 3), mm, and ball centres (n, 3, 2) in each image, px."""

    position_mm: Float
    centres_px: tuple[Float, Float]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit and print; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.doubt", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="+")
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(1)
    first, *others = options.directory
    training = joined(_rendered(first, tuple(WORSE), rng, SPOILT))
    parameters = fitted(training)
    print(parameters)
    checks = [(str(path), joined(_rendered(path, ("as it is",), rng, 0))) for path in (first, *others)]
    reports = [("the fit, with scenes left out", training, left_out(training))]
    reports += [(name, sample, sample.evidence.chances(parameters)) for name, sample in checks]
    columns = [
        "triads of",
        "stages",
        "triads",
        "false",
        "sum of chances",
        "log-loss",
        "false given",
        "true withheld",
    ]
    Grid.of(
        "Chance that a triad is false", columns, (_row(*report, parameters) for report in reports)
    ).print()
    return 0


def observations(evidence: TriadEvidence, parameters: DoubtParameters) -> Float:
    """Return the observations (t, 4) of the model as it limits them."""
    gain = evidence.gain.clip(-parameters.max_gain / 4, parameters.max_gain)
    return np.column_stack([gain, evidence.misfit, evidence.spread, evidence.deviation])


def fitted(sample: Sample) -> DoubtParameters:
    """Return the model of the largest likelihood, with a ridge; every group of samples has the same weight."""
    p = DoubtParameters()
    X = np.column_stack([np.ones(len(sample.false)), observations(sample.evidence, p)])
    ridge = RIDGE * np.diag([0.0, *np.ones(X.shape[1] - 1)])
    b = np.zeros(X.shape[1])
    for _ in range(100):
        chance = 1 / (1 + np.exp(-(X @ b).clip(-30, 30)))
        H = (X.T * (chance * (1 - chance))) @ X + ridge + 1e-9 * np.eye(len(b))
        b = b + np.linalg.solve(H, X.T @ (sample.false - chance) - ridge @ b)
    names = ("intercept", "gain", "misfit", "spread", "deviation")
    return replace(p, **{name: round(float(value), 3) for name, value in zip(names, b, strict=True)})


def left_out(sample: Sample) -> Float:
    """Return the chances (t,) of each triad by a fit without its group."""
    chances, group = np.empty(len(sample.false)), np.array(sample.group)
    for name in dict.fromkeys(sample.group):
        out = group == name
        chances[out] = taken(sample, out).evidence.chances(fitted(taken(sample, ~out)))
    return chances


def taken(sample: Sample, mask: Bool) -> Sample:
    """Return some of the triads."""
    index = np.flatnonzero(mask)
    return Sample(
        TriadEvidence(*(getattr(sample.evidence, f.name)[index] for f in fields(TriadEvidence))),
        sample.false[index],
        tuple(sample.group[k] for k in index),
        tuple(sample.stage[k] for k in index),
    )


def joined(samples: Sequence[Sample]) -> Sample:
    """Return all triads of samples, whose stages are numbered."""
    samples = [sample for sample in samples if len(sample.false)]
    evidence = (np.concatenate([getattr(s.evidence, f.name) for s in samples]) for f in fields(TriadEvidence))
    return Sample(
        TriadEvidence(*evidence),
        np.concatenate([sample.false for sample in samples]),
        tuple(name for sample in samples for name in sample.group),
        tuple(number for number, sample in enumerate(samples) for _ in sample.group),
    )


def _unlimited() -> SearchParameters:
    """Return search parameters with which every triad keeps its pose."""
    return SearchParameters(doubt=DoubtParameters(max_chance=1.0))


def _rendered(root: Path, ways: Sequence[str], rng: np.random.Generator, spoilt: int) -> list[Sample]:
    """Return the triads of rendered pairs, after each look, and with spoilt features."""
    p = replace(Parameters(), search=_unlimited())
    samples = []
    for scene in find_scenes(root):
        ranges = nominal_ranges_mm(scene.rig, p.search.matching.epipolar)
        detector = prepare_detector(scene.rig, ranges, p.ball_diameter_mm, p.detection, p.centres)
        truth, count = _truth(scene.triads), len(scene.triads)
        for way in ways:
            left, right = (replace(f, pixels=worsened(f.pixels, way, rng)) for f in read_frames(scene.folder))
            found = detector.detect(left, right)
            for look in range(p.second_look.rounds + 1):
                features = found[0].features, found[1].features
                search = _search(features, scene.rig, p.search, count, scene.spine_axis)
                places = missing_ball_places(
                    search, *features, scene.rig, ranges, MODELS, p.second_look, count
                )
                if spoilt or places is None or look == p.second_look.rounds:
                    samples.append(_sample(search, features, scene.rig, p.search, truth, scene))
                if places is None:
                    break
                found = detector.look_again((left, right), found, places)
            for _ in range(spoilt):
                worse = _spoilt(features, truth, rng)
                samples.append(
                    _judged(worse, scene.rig, p.search, truth, count, scene.spine_axis, scene.folder.name)
                )
    return samples


def _search(
    features: tuple[Features, Features],
    rig: Rig,
    parameters: SearchParameters,
    expected: int,
    axis: SpineAxis,
) -> TriadSearch:
    return match_triads(*features, rig, parameters, expected=expected, axis=axis, models=MODELS)


def _judged(
    features: tuple[Features, Features],
    rig: Rig,
    parameters: SearchParameters,
    truth: Truth,
    expected: int,
    axis: SpineAxis,
    group: str,
) -> Sample:
    search = _search(features, rig, parameters, expected, axis)
    return _sample_of(search, features, rig, parameters, truth, axis, group)


def _sample(
    search: TriadSearch,
    features: tuple[Features, Features],
    rig: Rig,
    parameters: SearchParameters,
    truth: Truth,
    scene: Scene,
) -> Sample:
    return _sample_of(search, features, rig, parameters, truth, scene.spine_axis, scene.folder.name)


def _sample_of(
    search: TriadSearch,
    features: tuple[Features, Features],
    rig: Rig,
    parameters: SearchParameters,
    truth: Truth,
    axis: SpineAxis,
    group: str,
) -> Sample:
    """Return the triads of a search, with their truth."""
    n = len(search.triads)
    if not n:
        none = np.empty(0)
        return Sample(TriadEvidence(none, none, none, none), none, (), ())
    evidence = triad_evidence(
        search.triads, search.selected, features, search.points, rig, MODELS, parameters.selection, axis
    )
    false = np.array([_is_false(search, k, features, rig, truth) for k in range(n)], dtype=np.float64)
    return Sample(evidence, false, (group,) * n, (0,) * n)


def _is_false(
    search: TriadSearch, k: int, features: tuple[Features, Features], rig: Rig, truth: Truth
) -> bool:
    """Return whether a triad has a wrong ball image, whichever true triad it is taken for, or a wrong position."""
    worst = np.zeros(len(truth.position_mm))
    for of_side, index, camera, centres in zip(
        features,
        (search.selected.left[k], search.selected.right[k]),
        (rig.left, rig.right),
        truth.centres_px,
        strict=True,
    ):
        depth = camera.depth_mm(search.triads[k].position_mm)
        radius = np.array(camera.ball_diameter_px(MODELS[0].ball_diameter_mm, depth)) / 2
        seen = np.flatnonzero(index[:3] != HIDDEN)
        gaps = np.linalg.norm((of_side.xy_px[index[seen]] - centres[:, seen]) / radius, axis=-1)
        worst = np.maximum(worst, gaps.max(axis=1))
    pose = search.triads[k].pose
    error = 0.0 if pose is None else np.linalg.norm(truth.position_mm - pose.position_mm, axis=1).min()
    return bool(worst.min() > WRONG_RADII or error > FALSE_MM)


def _truth(triads: Sequence[TrueTriad]) -> Truth:
    left, right = (
        np.array([[triad.centre_px[ball][side] for ball in MODELS[0].balls] for triad in triads])
        for side in SIDES
    )
    return Truth(np.array([triad.position_mm for triad in triads]), (left, right))


def _spoilt(
    features: tuple[Features, Features], truth: Truth, rng: np.random.Generator
) -> tuple[Features, Features]:
    """Return features of which up to three ball images of one triad are removed or displaced."""
    triad, displaced = int(rng.integers(len(truth.position_mm))), bool(rng.integers(2))
    picks = rng.choice(6, int(rng.integers(1, 4)), replace=False)
    spoilt = []
    for side, (of_side, centres) in enumerate(zip(features, truth.centres_px, strict=True)):
        xy, kept = of_side.xy_px.copy(), np.ones(len(of_side), dtype=bool)
        for pick in picks[picks // 3 == side]:
            near = np.linalg.norm(of_side.xy_px - centres[triad, pick % 3], axis=1) < 4
            kept &= displaced | ~near
            angle = rng.uniform(0, 2 * np.pi)
            xy[near] += displaced * rng.uniform(3, 12) * np.array([np.cos(angle), np.sin(angle)])
        spoilt.append(replace(of_side, xy_px=xy).take(np.flatnonzero(kept)))
    return spoilt[0], spoilt[1]


def _row(name: str, sample: Sample, chances: Float, p: DoubtParameters) -> list[str]:
    false, given = sample.false > 0, chances <= p.max_chance
    stages = max(len(set(sample.stage)), 1)
    loss = -np.mean(np.log(np.where(false, chances, 1 - chances).clip(1e-12)))
    return [
        name,
        str(stages),
        str(len(false)),
        str(int(false.sum())),
        f"{chances.sum():.1f}",
        f"{loss:.3f}",
        f"{int((false & given).sum())}, expected {chances[given].sum():.2f}",
        f"{int((~false & ~given).sum())} of {int((~false).sum())}",
    ]


if __name__ == "__main__":
    sys.exit(main())
