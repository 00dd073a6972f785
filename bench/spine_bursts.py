"""Bursts of stereo pairs: how the deviation falls with their number, and what breathing leaves in the measures."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.scoring import rms
from bench.spine_surgeries import BASELINE, POST, CartMotion, Surgery, simulated_surgery
from bench.spine_triads import RIG_NOISE, measured_triads
from bench.spine_truth import difference, true_value
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.simulation.breathing import BreathingParameters, breath_course, breathed, mean_breath_course
from spinewatch.simulation.observations import FeatureNoise
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scoliosis import CurveKind, triads_on
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.tracking.burst import combine_burst
from spinewatch.triads.pose import Pose

PAIRS = (1, 4, 16, 60)
BREATHING_PAIRS = 24
INTERVAL_S = 0.37
NOISE_ONLY = FeatureNoise(sigma_px=RIG_NOISE.sigma_px)
SHARED_ONLY = FeatureNoise(sigma_px=1e-3, common_sd_mrad=RIG_NOISE.common_sd_mrad)
_BINS = 4
_OF_THE_SPINE = ("T5", "T12", "L1")
_STAGES = (BASELINE, POST)


@dataclass(frozen=True)
class Fall:
    """Cobb angles of bursts of a number of pairs: RMS error, stated deviation, what to expect, share inside, %."""

    errors: str
    pairs: int
    rms_deg: float
    stated_deg: float
    expected_deg: float
    inside_pct: float


@dataclass(frozen=True)
class Bias:
    """What breathing does to a measure, in its stated deviations: the greatest mean of four parts of the breath.

    ``spread`` is the RMS over all bursts, ``single`` the same of a single pair at a random moment.
    """

    definition: str
    bursts: int
    worst: float
    standard_error: float
    spread: float
    single: float
    inside_pct: float


def falls(count: int) -> tuple[Fall, ...]:
    """Return the errors of Cobb angles of ``count`` surgeries by the number of pairs."""
    surgeries = _surgeries(count, 6)
    found = []
    floor = rms(_cobb(surgeries, 1, SHARED_ONLY)[0])
    for name, noise, least in (("noise", NOISE_ONLY, 0.0), ("noise and 0.12 mrad shared", RIG_NOISE, floor)):
        single = np.nan
        for pairs in PAIRS:
            errors, sd, inside = _cobb(surgeries, pairs, noise)
            if pairs == 1:
                single = rms(errors)
            expected = float(np.sqrt(least**2 + (single**2 - least**2) / pairs))
            found.append(Fall(name, pairs, rms(errors), rms(sd), expected, 100 * float(np.mean(inside))))
    return tuple(found)


def biases(count: int) -> tuple[Bias, ...]:
    """Return what breathing does to each measure of ``count`` surgeries."""
    surgeries = _surgeries(count, 7)
    ratios: dict[str, list[tuple[int, float, float, bool]]] = defaultdict(list)
    for number, surgery in enumerate(surgeries):
        phases = np.random.default_rng([12, 8, number]).random(2)
        mean = _mean(surgery)
        times = INTERVAL_S * np.arange(BREATHING_PAIRS, dtype=np.float64)
        by_kind = []
        for rise in (2.0, 0.0):
            breath = {
                s: BreathingParameters(rise, phase=float(p)) for s, p in zip(_STAGES, phases, strict=True)
            }
            stages = _burst_stages(surgery, times, RIG_NOISE, np.random.default_rng([12, 9, number]), breath)
            by_kind.append(_values(mean if rise else surgery, stages))
        moments = {s: BreathingParameters(2.0, phase=float(p)) for s, p in zip(_STAGES, phases, strict=True)}
        single = _values(mean, _still(surgery, moments))
        truths = mean.truth(POST), surgery.truth(POST)
        with_breath, without = by_kind
        for key in with_breath.keys() & without.keys():
            value, sd, low, high = with_breath[key]
            definition = key[0]
            if not sd > 0 or key not in single:
                continue
            true, true_without = (true_value(definition, key[1], truth) for truth in truths)
            error = difference(definition, value, true)
            ratio = (error - difference(definition, without[key][0], true_without)) / sd
            inside = 0 <= difference(definition, true, low) <= high - low
            at_once = difference(definition, single[key][0], true) / sd
            ratios[definition].append((int(phases[1] * _BINS), ratio, at_once, inside))
    return tuple(_bias(definition, rows) for definition, rows in sorted(ratios.items()))


def grids_and_bars(fall: Sequence[Fall], bias: Sequence[Bias]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the tables of bursts and their bars."""
    rows = [
        (
            f.errors,
            f.pairs,
            f"{f.rms_deg:.3f}",
            f"{f.expected_deg:.3f}",
            f"{f.stated_deg:.3f}",
            f"{f.inside_pct:.1f}",
        )
        for f in fall
    ]
    columns = [
        "errors of the centres",
        "pairs",
        "RMS error",
        "expected",
        "stated sd",
        "inside 95% interval, %",
    ]
    first = Grid.of("Cobb angle after a burst, degrees, exact initial poses", columns, rows)
    columns = [
        "measure",
        "n",
        "bias / sd",
        "+-",
        "RMS / sd",
        "one pair: RMS / that sd",
        "inside 95% interval, %",
    ]
    second = Grid.of(
        f"Breathing of 2 mm at 15 a minute, bursts of {BREATHING_PAIRS} pairs in {BREATHING_PAIRS * INTERVAL_S:.1f} s",
        columns,
        [
            (
                b.definition,
                b.bursts,
                f"{b.worst:.2f}",
                f"{b.standard_error:.2f}",
                f"{b.spread:.2f}",
                f"{b.single:.2f}",
                f"{b.inside_pct:.1f}",
            )
            for b in bias
        ],
    )
    ratio = [f.rms_deg / f.expected_deg for f in fall]
    stated = [f.stated_deg / f.rms_deg for f in fall]
    honest = [f.inside_pct for f in fall if f.pairs > 1]
    worst = max(bias, key=lambda b: b.worst)
    return [first, second], (
        Bar(
            "deviation falls with the number of pairs as it should, within 15%",
            f"{min(ratio):.2f} to {max(ratio):.2f} of what is expected",
            all(0.85 <= r <= 1.15 for r in ratio),
        ),
        Bar(
            "and so does the stated deviation, within 25% of the errors",
            f"{min(stated):.2f} to {max(stated):.2f} of the RMS error",
            all(0.75 <= r <= 1.25 for r in stated),
        ),
        Bar(
            "95% intervals of bursts hold at least 93%",
            f"{min(honest):.1f} to {max(honest):.1f}%",
            min(honest) >= 93,
        ),
        Bar(
            "breathing biases no measure by more than 0.2 of its deviation",
            f"{worst.worst:.2f} ({worst.definition})",
            worst.worst <= 0.2,
        ),
    )


def _surgeries(count: int, seed: int) -> list[Surgery]:
    kinds = list(CurveKind)
    return [
        simulated_surgery(
            np.random.default_rng([12, seed, i]), kinds[i % 3], extra=_OF_THE_SPINE, cart=CartMotion()
        )
        for i in range(count)
    ]


def _cobb(
    surgeries: Sequence[Surgery], pairs: int, noise: FeatureNoise
) -> tuple[list[float], list[float], list[bool]]:
    """Return errors and stated deviations of the Cobb angles after bursts, and whether they are in their intervals."""
    errors, sds, inside = [], [], []
    still = dict.fromkeys(_STAGES, BreathingParameters(0.0))
    for number, surgery in enumerate(surgeries):
        rng = np.random.default_rng([12, 10, number])
        stages = _burst_stages(surgery, None, noise, rng, still, pairs)
        truth = surgery.truth(POST)
        for (definition, levels), (value, sd, low, high) in _values(surgery, stages).items():
            if definition == "cobb-fixed":
                true = true_value(definition, levels, truth)
                errors.append(value - true)
                sds.append(sd)
                inside.append(low <= true <= high)
    return errors, sds, inside


def _burst_stages(
    surgery: Surgery,
    times_s: Float | None,
    noise: FeatureNoise,
    rng: np.random.Generator,
    breath: Mapping[str, BreathingParameters],
    pairs: int = BREATHING_PAIRS,
) -> dict[str, dict[str, Pose]]:
    """Return the mean poses of the triads after a burst at each stage; pointing errors last through a burst."""
    stages = {}
    for stage in _STAGES:
        shares = breath_course(times_s, breath[stage]) if times_s is not None else np.zeros(pairs)
        own = surgery.spines[stage].poses
        true: list[Pose] = []
        for share in shares:
            poses = surgery.in_object_space(stage, breathed(own, float(share), breath[stage]))
            true += triads_on(poses, surgery.mounts).values()
        levels, n = list(surgery.mounts), len(shares)
        pointing = np.tile(rng.standard_normal((len(levels), 2, 2)), (n, 1, 1))
        found = measured_triads(large_rig(), true, rng, noise, pointing)
        burst = [
            {level: pose for level, pose in zip(levels, found[k::], strict=False) if pose is not None}
            for k in range(0, len(found), len(levels))
        ]
        stages[stage] = dict(combine_burst(burst, times_s, surgery.reference).poses)
    return stages


def _still(surgery: Surgery, breath: Mapping[str, BreathingParameters]) -> dict[str, dict[str, Pose]]:
    """Return the true poses of the triads at a moment of the breath at each stage."""
    stages = {}
    for stage in _STAGES:
        share = float(breath_course(np.zeros(1), breath[stage])[0])
        poses = breathed(surgery.spines[stage].poses, share, breath[stage])
        stages[stage] = triads_on(surgery.in_object_space(stage, poses), surgery.mounts)
    return stages


Values = dict[tuple[str, tuple[str, ...]], tuple[float, float, float, float]]
"""Value, deviation and interval of measured measures at POST, by definition and levels."""


def _values(surgery: Surgery, stages: Mapping[str, Mapping[str, Pose]]) -> Values:
    if any(surgery.reference not in poses for poses in stages.values()):
        return {}
    setup = surgery.exact_setup()
    baseline: SpineConfiguration = spine_at_stage(setup, stages, BASELINE)
    spine = spine_at_stage(setup, stages, POST)
    return {
        (v.definition, v.levels): (v.value, v.sd, v.lower, v.upper)
        for v in measure_spine(spine, baseline).measures
        if v.status is MeasureStatus.MEASURED and v.definition != "cobb-reselected"
    }


def _mean(surgery: Surgery) -> Surgery:
    """Return a surgery with the true poses in the mean of a breath at both stages."""
    mean = mean_breath_course()
    bodies, triads = {}, {}
    for stage in _STAGES:
        own = breathed(surgery.spines[stage].poses, mean)
        bodies[stage] = surgery.in_object_space(stage, own)
        triads[stage] = triads_on(bodies[stage], surgery.mounts)
    return replace(surgery, bodies=bodies, triads=triads)


def _bias(definition: str, rows: Sequence[tuple[int, float, float, bool]]) -> Bias:
    """Return the summary of (part of the breath, ratio with a burst, ratio with a pair, inside) of a measure."""
    part, ratio, single, inside = (np.array(column) for column in zip(*rows, strict=True))
    means = [float(ratio[part == k].mean()) for k in range(_BINS) if np.any(part == k)]
    smallest = min(int(np.sum(part == k)) for k in range(_BINS) if np.any(part == k))
    return Bias(
        definition,
        len(rows),
        float(np.abs(means).max()),
        float(ratio.std() / np.sqrt(smallest)),
        rms(ratio),
        rms(single),
        100 * float(inside.mean()),
    )
