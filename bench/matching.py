"""``python -m bench.matching [DIR]``: from features to poses, on simulated scenes and, with DIR, on rendered ones.

``--check`` ends with status 1 when a bar is missed. Times are processor times, which other processes do not affect.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from bench import scenes
from bench.scoring import GATE_MM, rms
from bench.tables import Bar, Grid, bars
from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.geometry.transforms import fit_rigid, rigid_covariance
from spinewatch.markers import FLAT_10_14_18, TriadModel, scaled
from spinewatch.matching.rig_check import check_rig
from spinewatch.planning.accuracy import expected_accuracy, straight_chain
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import (
    convergence_point,
    converging_rig,
    large_rig,
    perturbed_rig,
    small_rig,
)
from spinewatch.simulation.scenes import SceneParameters, SimulatedScene, simulate_scene
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import MeasuredTriad, Pose
from spinewatch.triads.pose_fit import PoseParameters
from spinewatch.triads.search import SearchParameters, TriadSearch, ball_images, marker_balls, match_triads

SCENES = 2000
CHI2_95 = 7.815  # 3 degrees of freedom
_EXACT = SearchParameters(pose=PoseParameters(common_sd_mrad=0.0))
_REALISTIC = "calibration errors of 0.005 deg and 0.05 mm, 0.13 mrad shared"
_YAW, _BASE = "0.3 deg about its y", "a base longer by 1%"
_LEVELS = ("L1", "T11", "T9", "T7", "T5", "T3", "T1")


@dataclass
class Tally:
    """Counts over the scenes of one kind; chi-squares of (position, rotation) errors by whether a ball is hidden."""

    name: str
    complete: int = 0
    scenes: int = 0
    placed: int = 0
    posed: int = 0
    false: int = 0
    hidden: int = 0
    hidden_posed: int = 0
    milliseconds: list[float] = field(default_factory=list)
    position_mm: list[float] = field(default_factory=list)
    rotation_deg: list[float] = field(default_factory=list)
    chi2: dict[bool, list[tuple[float, float]]] = field(default_factory=lambda: {False: [], True: []})

    @property
    def complete_pct(self) -> float:
        """Percentage of scenes in which every triad has a pose."""
        return 100 * self.complete / self.scenes

    @property
    def false_pct(self) -> float:
        """Number of false triads per 100 scenes."""
        return 100 * self.false / self.scenes

    def coverage(self, occluded: bool) -> tuple[float, float]:
        """Return the percentages of positions and of rotations within their 95% region; NaN without any."""
        values = np.array(self.chi2[occluded]).reshape(-1, 2)
        if not len(values):
            return float("nan"), float("nan")
        position, rotation = 100 * (values <= CHI2_95).mean(axis=0)
        return float(position), float(rotation)


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """Errors of poses in full view by one method: (n, 3), mm and degrees about the triad's axes; chi-squares (n, 2)."""

    method: str
    position_mm: Float
    rotation_deg: Float
    chi2: Float

    @property
    def rotation_rms_deg(self) -> float:
        """RMS angle of the rotation error, degrees."""
        return rms(np.linalg.norm(self.rotation_deg, axis=1))


@dataclass(frozen=True, eq=False)
class Outcome:
    """Results of all parts."""

    simulated: Sequence[Tally]
    methods: Sequence[PoseErrors]
    drift: Sequence[tuple[str, float]]
    scale: Sequence[tuple[str, float, float]]
    rendered: scenes.Outcome | None

    @cached_property
    def bars(self) -> tuple[Bar, ...]:
        """The bars."""
        by_name = {tally.name: tally for tally in self.simulated}
        found = [*_simulated_bars(by_name), *_method_bars(*self.methods), *_drift_bars(dict(self.drift))]
        found += _scale_bars({(name, sigma): share for name, sigma, share in self.scale})
        if self.rendered is not None:
            found += _rendered_bars(self.rendered.figures["all"])
        return tuple(found)

    @property
    def grids(self) -> Iterator[Grid]:
        """The tables."""
        yield _simulated_grid(self.simulated)
        yield _method_grid(self.methods)
        yield Grid.of(
            "Detection of a bumped camera from 5 triads at 0.1 px, % of bumps",
            ["motion of the right camera", "flagged"],
            ((name, f"{share:.0f}%") for name, share in self.drift),
        )
        yield Grid.of(
            "Detection of a changed scale of the markers from 4 triads, % of stages",
            ["motion of the right camera", "px", "flagged"],
            ((name, f"{sigma:.1f}", f"{share:.0f}%") for name, sigma, share in self.scale),
        )
        yield limits()
        yield bars(self.bars)


def measure(count: int, root: Path | None) -> Outcome:
    """Run all parts, with ``count`` complete scenes and fewer of the other kinds."""
    ten, rig = FeatureNoise(0.1, 0.0, 10), large_rig()
    plain = SceneParameters(noise=ten)
    part = max(count // 10, 20)
    kinds = [
        ("complete", rig, plain, count),
        ("one ball hidden", rig, replace(plain, hidden=1), count // 2),
        ("320 mm, 24 deg", small_rig(), plain, part),
        ("300 mm, 18 deg", converging_rig(300, 18), plain, part),
        ("480 mm, 32 deg", converging_rig(480, 32), plain, part),
        ("table 3.3 errors, 0.13 mrad shared", rig, replace(plain, noise=FeatureNoise(0.1, 0.13, 10)), part),
        ("gaps 1:3:2", rig, replace(plain, steps=(1.0, 3.0, 2.0), spacing_mm=30.0), part),
        ("bent by 90 deg", rig, replace(plain, bend_deg=90.0), part),
        ("100 false features, 0.25 px", rig, replace(plain, noise=FeatureNoise(0.25, 0.0, 100)), part),
        ("7 triads, 60 features", rig, _crowd(7, 39), part),
        ("5 triads, 200 features", rig, _crowd(5, 185), part),
    ]
    simulated = [simulate(*kind) for kind in kinds]
    rendered = scenes.measure(root) if root is not None else None
    return Outcome(simulated, pose_methods(part), drift_found(40), scale_found(100), rendered)


def simulate(name: str, rig: Rig, parameters: SceneParameters, count: int) -> Tally:
    """Measure ``count`` random scenes of one kind."""
    tally = Tally(name)
    shared = parameters.noise.common_sd_mrad
    search = replace(_EXACT, pose=PoseParameters(common_sd_mrad=shared))
    for number in range(count):
        scene = simulate_scene(rig, parameters, np.random.default_rng([1995, number]))
        _count(tally, scene, search)
    return tally


def pose_methods(count: int) -> tuple[PoseErrors, PoseErrors]:
    """Return the errors of absolute orientation on triangulated balls and of `fit_poses`, on the same triads."""
    peer: list[tuple[Pose, Pose]] = []
    ours: list[tuple[Pose, Pose]] = []
    for number in range(count):
        scene = simulate_scene(
            large_rig(), SceneParameters(noise=FeatureNoise(0.1)), np.random.default_rng([1976, number])
        )
        for triad in _search(scene, _EXACT).triads:
            truth = min(scene.poses, key=lambda pose: _distance_mm(pose, triad))
            if triad.pose is None or _occluded(triad) or _distance_mm(truth, triad) > GATE_MM:
                continue
            peer.append((truth, absolute_orientation(triad, FLAT_10_14_18)))
            ours.append((truth, triad.pose))
    return (
        _pose_errors("absolute orientation (Kabsch) on triangulated points", peer),
        _pose_errors("fit_poses on the ball images", ours),
    )


def absolute_orientation(triad: MeasuredTriad, model: TriadModel) -> Pose:
    """Return the pose that brings a marker nearest to the triangulated balls of a triad in full view."""
    balls = [triad.balls[name] for name in model.balls]
    points = np.stack([ball.position_mm for ball in balls])
    fit = fit_rigid(model.coordinates_mm, points)
    covariance = rigid_covariance(
        fit.translation_mm, points, np.stack([ball.covariance_mm2 for ball in balls])
    )
    return Pose(fit.translation_mm, fit.rotation, covariance)


def drift_found(count: int) -> tuple[tuple[str, float], ...]:
    """Return the percentage of bumps flagged: none, rotations of 0.05 degrees and shifts of 0.4 mm."""
    names = (
        *(f"0.05 deg about its {axis}" for axis in "xyz"),
        *(f"0.4 mm along its {axis}" for axis in "xyz"),
    )
    motions = np.diag([*np.radians([0.05] * 3), *[0.4] * 3])
    return (
        ("none", _flagged(np.zeros(6), 5 * count)),
        (_REALISTIC, _flagged(np.zeros(6), 5 * count, triads=4, realistic=True)),
        *((name, _flagged(motion, count)) for name, motion in zip(names, motions, strict=True)),
    )


def scale_found(count: int) -> tuple[tuple[str, float, float], ...]:
    """Return the percentage of motions along the epipolar lines flagged, from 4 triads by the noise of the features."""
    base = large_rig().right.M @ (large_rig().right.centre - large_rig().left.centre)
    motions = {
        _YAW: np.array([0.0, np.radians(0.3), 0.0, 0.0, 0.0, 0.0]),
        _BASE: np.concatenate([np.zeros(3), 0.01 * base]),
        "2 mm towards the field": np.array([0.0, 0.0, 0.0, 0.0, 0.0, -2.0]),
    }
    return tuple(
        (name, sigma, _flagged(motion, count, triads=4, sigma_px=sigma))
        for name, motion in motions.items()
        for sigma in (0.1, 0.2, 0.3)
    )


def limits() -> Grid:
    """Return predicted standard deviations of the cart and of possible improvements."""
    kinds = (
        ("as it is, 0.1 px", large_rig(), 1.0, 0.1),
        ("0.05 px", large_rig(), 1.0, 0.05),
        ("triads 1.5 times larger", large_rig(), 1.5, 0.1),
        ("1920 x 1408 sensor, 0.1 of its px", converging_rig(420, 32, image_size_px=(1920, 1408)), 1.0, 0.1),
        (
            "1920 x 1408 sensor, 0.34 of its px",
            converging_rig(420, 32, image_size_px=(1920, 1408)),
            1.0,
            0.34,
        ),
    )
    rows = []
    for name, rig, size, sigma in kinds:
        chain = straight_chain(_LEVELS[:4], convergence_point(rig), 50.0)
        planned = expected_accuracy(rig, scaled(FLAT_10_14_18, size), _LEVELS[:4], chain, sigma)
        far = planned.triads[-1]
        rows.append(
            (
                name,
                f"{rms([np.linalg.norm(t.position_sd_mm) for t in planned.triads]):.2f}",
                f"{rms([t.in_plane_sd_deg for t in planned.triads]):.2f}",
                f"{rms([t.out_of_plane_sd_deg for t in planned.triads]):.2f}",
                f"{np.linalg.norm(far.motion_sd_mm):.2f}",
                f"{planned.cobb_sd_deg:.2f}",
            )
        )
    columns = ["", "P mm", "in plane deg", "tilt deg", "motion of the far end mm", "Cobb deg"]
    return Grid.of("Predicted standard deviations, 4 triads 50 mm apart", columns, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.matching", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="?", help="rendered scenes with truth")
    parser.add_argument("--scenes", type=int, default=SCENES, help="simulated scenes of the first kind")
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write the bars here")
    options = parser.parse_args(arguments)
    outcome = measure(options.scenes, options.directory)
    for grid in outcome.grids:
        grid.print()
    if options.json:
        reached = {bar.promise: {"reached": bar.reached, "holds": bar.holds} for bar in outcome.bars}
        options.json.write_text(json.dumps(reached, indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def _crowd(triads: int, false: int) -> SceneParameters:
    return SceneParameters(labels=_LEVELS[:triads], spacing_mm=45.0, noise=FeatureNoise(0.1, 0.0, false))


def _search(scene: SimulatedScene, parameters: SearchParameters) -> TriadSearch:
    """Return the triads found in a scene."""
    return match_triads(
        scene.observation.left,
        scene.observation.right,
        scene.rig,
        parameters,
        expected=len(scene.poses),
        axis=scene.parameters.axis,
    )


def _count(tally: Tally, scene: SimulatedScene, parameters: SearchParameters) -> None:
    start = process_time()
    search = _search(scene, parameters)
    tally.milliseconds.append((process_time() - start) * 1e3)
    with_hidden_ball = {ball // 3 for ball, _ in scene.hidden}
    found = set()
    for triad in search.triads:
        if triad.pose is None:
            continue
        distances = [_distance_mm(pose, triad) for pose in scene.poses]
        nearest = int(np.argmin(distances))
        if distances[nearest] > GATE_MM or nearest in found:
            tally.false += 1
            continue
        found.add(nearest)
        occluded = _occluded(triad)
        tally.chi2[occluded].append(_chi2(scene.poses[nearest], triad.pose))
        if not occluded:
            position, rotation = _errors(scene.poses[nearest], triad.pose)
            tally.position_mm.append(float(np.linalg.norm(position)))
            tally.rotation_deg.append(float(np.linalg.norm(rotation)))
    tally.scenes += 1
    tally.placed += len(scene.poses)
    tally.posed += len(found)
    tally.complete += len(found) == len(scene.poses)
    tally.hidden += len(with_hidden_ball)
    tally.hidden_posed += len(with_hidden_ball & found)


def _occluded(triad: MeasuredTriad) -> bool:
    return any(ball.hidden_in for ball in triad.balls.values())


def _distance_mm(truth: Pose, triad: MeasuredTriad) -> float:
    return float(np.linalg.norm(truth.position_mm - triad.position_mm))


def _errors(truth: Pose, found: Pose) -> tuple[Float, Float]:
    """Return the position error (3,), mm, and the rotation error (3,) about object axes, degrees."""
    rotation = np.degrees(vector_from_rotation(truth.rotation @ found.rotation.T))
    return truth.position_mm - found.position_mm, rotation


def _chi2(truth: Pose, found: Pose) -> tuple[float, float]:
    """Return the chi-squares of the position and of the rotation error."""
    position, rotation = _errors(truth, found)
    return (
        float(position @ np.linalg.solve(found.covariance[:3, :3], position)),
        float(rotation @ np.linalg.solve(found.covariance[3:, 3:], rotation)),
    )


def _pose_errors(method: str, pairs: Sequence[tuple[Pose, Pose]]) -> PoseErrors:
    """Return the errors of pairs of a true and a found pose."""
    errors = [_errors(truth, found) for truth, found in pairs]
    own_axes = [truth.rotation.T @ rotation for (truth, _), (_, rotation) in zip(pairs, errors, strict=True)]
    chi2 = np.array([_chi2(truth, found) for truth, found in pairs])
    return PoseErrors(method, np.array([position for position, _ in errors]), np.array(own_axes), chi2)


def _flagged(
    motion: Float, count: int, triads: int = 5, sigma_px: float = 0.1, realistic: bool = False
) -> float:
    """Return the percentage of rigs flagged after a motion (6,) of the right camera, radians and mm."""
    rig = large_rig()
    true = Rig("bumped", rig.left, rig.right.moved(motion[:3], motion[3:]))
    noise = FeatureNoise(sigma_px, 0.13 if realistic else 0.0, 10)
    flags = []
    for seed in range(count):
        rng = np.random.default_rng([5, seed])
        observed = observe(true, random_spine(rng, triads, spacing_mm=45), rng, noise)
        known = perturbed_rig(rig, rng, 0.005, 0.05) if realistic else rig
        found = match_triads(observed.left, observed.right, known, _EXACT, expected=triads, axis="x")
        balls = ball_images(found, observed.left, observed.right)
        check = check_rig(known, *balls, markers=marker_balls(found, (FLAT_10_14_18,)))
        flags.append(check is not None and check.drifted)
    return 100 * float(np.mean(flags))


def _simulated_grid(tallies: Sequence[Tally]) -> Grid:
    columns = [
        "scenes",
        "n",
        "all posed",
        "false",
        "hidden posed",
        "P mm",
        "rotation deg",
        "in 95% (P, rot)",
        "occluded",
        "ms",
    ]
    rows = (
        (
            t.name,
            t.scenes,
            f"{t.complete_pct:.2f}%",
            t.false,
            f"{t.hidden_posed}/{t.hidden}",
            f"{rms(t.position_mm):.2f}",
            f"{rms(t.rotation_deg):.2f}",
            "{:.1f} {:.1f}".format(*t.coverage(False)),
            "{:.1f} {:.1f}".format(*t.coverage(True)),
            f"{np.median(t.milliseconds):.1f}",
        )
        for t in tallies
    )
    return Grid.of("Simulated scenes", columns, rows)


def _method_grid(methods: Sequence[PoseErrors]) -> Grid:
    rows = (
        (
            errors.method,
            len(errors.position_mm),
            f"{rms(np.linalg.norm(errors.position_mm, axis=1)):.3f}",
            f"{rms(errors.rotation_deg[:, 2]):.3f}",
            f"{rms(np.linalg.norm(errors.rotation_deg[:, :2], axis=1)):.3f}",
            "{:.1f} {:.1f}".format(*(100 * (errors.chi2 <= CHI2_95).mean(axis=0))),
        )
        for errors in methods
    )
    columns = ["pose by", "triads", "P mm", "in plane deg", "tilt deg", "in 95% (P, rot)"]
    return Grid.of("Poses of the same triads by two methods, 0.1 px", columns, rows)


def _method_bars(peer: PoseErrors, ours: PoseErrors) -> Iterator[Bar]:
    ratio = ours.rotation_rms_deg / peer.rotation_rms_deg
    yield Bar("rotation errors <= 0.85 of absolute orientation's", f"{ratio:.2f}", ratio <= 0.85)


def _simulated_bars(by_name: dict[str, Tally]) -> Iterator[Bar]:
    complete, hidden = by_name["complete"], by_name["one ball hidden"]
    yield Bar(
        f"all triads in >= 99.5% of {complete.scenes} scenes",
        f"{complete.complete_pct:.2f}%",
        complete.complete_pct >= 99.5,
    )
    yield Bar("false triads in < 0.1% of them", f"{complete.false_pct:.2f}%", complete.false_pct < 0.1)
    share = 100 * hidden.hidden_posed / hidden.hidden
    yield Bar("a pose in >= 98% with a ball hidden in a view", f"{share:.1f}%", share >= 98)
    yield Bar("false triads there in < 0.1%", f"{hidden.false_pct:.2f}%", hidden.false_pct < 0.1)
    for name, values in (("complete", complete.coverage(False)), ("occluded", hidden.coverage(True))):
        text = "{:.1f}%, {:.1f}%".format(*values)
        yield Bar(f"95% regions hold 93-97%, {name}", text, all(93 <= value <= 97 for value in values))
    for name in ("320 mm, 24 deg", "300 mm, 18 deg", "480 mm, 32 deg", "gaps 1:3:2", "bent by 90 deg"):
        tally = by_name[name]
        yield Bar(
            f"all triads, {name}", f"{tally.complete_pct:.1f}%", tally.complete_pct >= 99 and not tally.false
        )
    for name, limit in (("7 triads, 60 features", 20), ("5 triads, 200 features", 50)):
        ms = float(np.median(by_name[name].milliseconds))
        yield Bar(f"{name} in < {limit} ms", f"{ms:.1f} ms", ms < limit)


def _drift_bars(found: dict[str, float]) -> Iterator[Bar]:
    rotation, shift = found["0.05 deg about its x"], found["0.4 mm along its y"]
    yield Bar(
        "a rotation of 0.05 deg across the epipolar lines is flagged", f"{rotation:.0f}%", rotation >= 95
    )
    yield Bar("a shift of 0.4 mm across them is flagged", f"{shift:.0f}%", shift >= 75)
    for name in ("none", _REALISTIC):
        yield Bar(f"a rig without drift is flagged in <= 1%: {name}", f"{found[name]:.1f}%", found[name] <= 1)


def _scale_bars(found: dict[tuple[str, float], float]) -> Iterator[Bar]:
    for name in (_YAW, _BASE):
        share = found[name, 0.1]
        yield Bar(f"{name} is flagged in >= 95%, 0.1 px", f"{share:.0f}%", share >= 95)


def _rendered_bars(figures: dict[str, Any]) -> Iterator[Bar]:
    yield Bar(
        "rendered: within 1 mm >= 95%", f"{figures['within1mm_pct']:.1f}%", figures["within1mm_pct"] >= 95
    )
    yield Bar("rendered: no false triad", str(figures["false"]), figures["false"] == 0)
    for name, limit in (
        ("P_rms_mm", 0.25),
        ("rot_rms_deg", 1.4),
        ("inplane_rms_deg", 0.35),
        ("motion_t_rms_mm", 0.6),
        ("motion_rot_rms_deg", 2.5),
        ("motion_inplane_rms_deg", 0.7),
    ):
        value = float(figures[name])
        yield Bar(f"rendered: {name} <= {limit}", f"{value:.2f}", value <= limit)


if __name__ == "__main__":
    sys.exit(main())
