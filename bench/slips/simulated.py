"""Simulated stages: rate of flags of sound ones, and of those of a moved camera.

``measure`` is the only function that calls the measuring library.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.matching.rig_check import RigCheckParameters
from spinewatch.simulation.observations import FeatureNoise
from spinewatch.simulation.rigs import large_rig, random_rig, small_rig
from spinewatch.simulation.scenes import SceneParameters, SimulatedScene, simulate_scene
from spinewatch.triads.drift import search_and_check_rig
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.labels import label_triads
from spinewatch.triads.pose_fit import PoseParameters
from spinewatch.triads.search import SearchParameters, match_triads

SOUND = 500
MOVED = 200
DRIFT = "calibration-drift"
_SEARCH = SearchParameters(pose=PoseParameters(common_sd_mrad=0.0))
_SEED = 1111

_LEVEL_MM = 27.0
_CHAINS: tuple[tuple[tuple[str, ...], tuple[float, ...]], ...] = (
    (("L1", "T11", "T9", "T7"), (2.0, 2.0, 2.0)),
    (("L3", "L1", "T10", "T8"), (2.0, 3.0, 2.0)),
    (("T12", "T10", "T9", "T7"), (2.0, 1.0, 2.0)),
    (("T5", "T7", "T9", "T11", "L1"), (2.0, 2.0, 2.0, 2.0)),
)
"""Labels by increasing coordinate, and the levels between neighbours."""

Change = Callable[[Rig], Rig]


@dataclass(frozen=True)
class Rate:
    """Number of simulated stages that raised a flag."""

    name: str
    raised: int
    stages: int
    codes: tuple[tuple[str, int], ...]

    @property
    def percent(self) -> float:
        """Percentage of the stages that raised a flag."""
        return 100 * self.raised / self.stages


def measure(scene: SimulatedScene) -> tuple[str, ...]:
    """Return the codes of the flags that the library raises on the features of a simulated stage."""
    labels, axis = scene.parameters.labels, scene.parameters.axis
    left, right = scene.observation.left, scene.observation.right
    found, _, rig_flags = search_and_check_rig(
        lambda rig: match_triads(left, right, rig, _SEARCH, expected=len(labels), axis=axis),
        left,
        right,
        scene.rig,
        RigCheckParameters(),
    )
    _, label_flags = label_triads(found.triads, labels, axis, LabelParameters())
    return tuple(flag.code for flag in (*found.flags, *rig_flags, *label_flags))


def sound_rate(count: int = SOUND, progress: Callable[[], object] | None = None) -> Rate:
    """Return how many sound stages raise any flag: full views of several chains of triads in several rigs."""
    return _rate("sound stages", _sound_scenes(count), None, progress)


def yaw_rate(degrees: float, count: int = MOVED, progress: Callable[[], object] | None = None) -> Rate:
    """Return how many stages of 4 triads reveal a rotation of the right camera about the vertical of its image."""
    rotation = np.array([0.0, np.radians(degrees), 0.0])

    def moved(rig: Rig) -> Rig:
        return Rig(rig.name, rig.left, rig.right.moved(rotation, np.zeros(3)))

    return _rate(f"right camera yawed by {degrees:g} degrees", _moved_scenes(count, moved), DRIFT, progress)


def base_rate(share: float, count: int = MOVED, progress: Callable[[], object] | None = None) -> Rate:
    """Return how many stages of 4 triads reveal a change of the base."""

    def moved(rig: Rig) -> Rig:
        base = rig.right.centre - rig.left.centre
        return Rig(rig.name, rig.left, rig.right.moved(np.zeros(3), rig.right.M @ (share * base)))

    return _rate(f"base changed by {100 * share:+g}%", _moved_scenes(count, moved), DRIFT, progress)


def _rate(
    name: str, scenes: Iterator[SimulatedScene], counted: str | None, progress: Callable[[], object] | None
) -> Rate:
    codes: dict[str, int] = {}
    raised = stages = 0
    for scene in scenes:
        flags = set(measure(scene))
        stages += 1
        raised += bool(flags) if counted is None else counted in flags
        for code in flags:
            codes[code] = codes.get(code, 0) + 1
        if progress is not None:
            progress()
    return Rate(name, raised, stages, tuple(sorted(codes.items())))


def _sound_scenes(count: int) -> Iterator[SimulatedScene]:
    """Yield stages with every ball in both views; a flag about a hidden ball is no false alarm."""
    number = made = 0
    while made < count:
        rng = np.random.default_rng([_SEED, number])
        rig = (large_rig(), small_rig(), random_rig(rng))[number % 3]
        number += 1
        scene = simulate_scene(rig, _parameters(number), rng)
        if _in_view(scene):
            made += 1
            yield scene


def _moved_scenes(count: int, moved: Change) -> Iterator[SimulatedScene]:
    """Yield stages of 4 triads observed by the moved rig and measured with the calibrated one."""
    rig = large_rig()
    for number in range(count):
        rng = np.random.default_rng([_SEED, 7, number])
        scene = simulate_scene(
            moved(rig), replace(_parameters(number), labels=_CHAINS[0][0], steps=_CHAINS[0][1]), rng
        )
        yield replace(scene, rig=rig)


def _parameters(number: int) -> SceneParameters:
    labels, steps = _CHAINS[number % len(_CHAINS)]
    false = (4, 10, 25)[number % 3]
    return SceneParameters(
        labels=labels, steps=steps, spacing_mm=_LEVEL_MM, noise=FeatureNoise(0.1, 0.0, false)
    )


def _in_view(scene: SimulatedScene) -> bool:
    balls = 3 * len(scene.poses)
    return all(
        int((seen >= 0).sum()) == balls
        for seen in (scene.observation.left_ball, scene.observation.right_ball)
    )
