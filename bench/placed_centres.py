"""``python -m bench.placed_centres DIR``: centres that a person places well and badly, in rendered pairs under DIR.

One or all balls of a triad are placed in one image: on the ball, on a ball that was not detected, or displaced along
the rows. The table tells how often the flag ``centre-displaced`` is raised, how often another one tells that the
edit does not fit, and of the others how often the position is off by more than three standard deviations.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.tables import Grid
from bench.truth import Scene, find_scenes, read_frames
from spinewatch.arrays import Bool
from spinewatch.detection.candidates.search import Detection
from spinewatch.detection.manual import CentreEdit
from spinewatch.detection.refinement.duplicates import same_ball
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.pipeline import StageMeasurer
from spinewatch.stage import StageMeasurement, StageRequest
from spinewatch.triads.moved_triads import EarlierTriad, moved_triad_flags

NEAR_MM = 20.0
"""A triad nearer than this to a true one is that one."""

UNFIT = frozenset({"centre-unused", "triad-count-low", "triad-incomplete", "no-triads"})
"""Flags that tell that an edit does not fit."""


@dataclass(frozen=True)
class Case:
    """A way to place centres: how many balls, how far off, and whether the detector had found them."""

    name: str
    balls: int
    shift_px: float
    detected: bool = True


CASES = (
    *(Case("on the ball", balls, 0.0) for balls in (1, 3)),
    *(Case("on a ball that was not detected", balls, 0.0, detected=False) for balls in (1, 3)),
    *(Case(f"{shift:g} px off", balls, shift) for shift in (1.5, 3.0, 8.0, 20.0) for balls in (1, 3)),
    *(
        Case(f"{shift:g} px off a ball that was not detected", 3, shift, detected=False)
        for shift in (3.0, 8.0)
    ),
)


@dataclass(frozen=True)
class Edited:
    """What became of an edit: its flags, and the error of the triad, mm and standard deviations; NaN without it."""

    codes: frozenset[str]
    error_mm: float
    error_sd: float

    @property
    def flagged(self) -> bool:
        """Whether the displacement was flagged."""
        return "centre-displaced" in self.codes


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.placed_centres", description=__doc__)
    parser.add_argument("root", type=Path, help="folder of rendered pairs")
    root = parser.parse_args(arguments).root
    outcomes: dict[Case, list[Edited]] = {case: [] for case in CASES}
    for scene in find_scenes(root):
        for case, edited in _of_scene(scene):
            outcomes[case].append(edited)
    columns = [
        "placed",
        "balls",
        "edits",
        "centre-displaced",
        "triad-moved-by-edit",
        "other flag",
        "none",
        "of these > 3 sd",
        "worst, mm",
    ]
    Grid.of("Placed centres", columns, (_row(case, edits) for case, edits in outcomes.items())).print()
    return 0


def _row(case: Case, edits: Sequence[Edited]) -> Iterator[object]:
    flagged = [edit for edit in edits if edit.flagged]
    moved = sum("triad-moved-by-edit" in edit.codes for edit in edits)
    rest = [edit for edit in edits if not edit.codes & {"centre-displaced", "triad-moved-by-edit"}]
    quiet = [edit for edit in rest if not edit.codes & UNFIT]
    yield from (case.name, case.balls, len(edits), len(flagged), moved, len(rest) - len(quiet), len(quiet))
    yield sum(edit.error_sd > 3 for edit in quiet)
    yield f"{max((edit.error_mm for edit in quiet), default=0.0):.1f}"


def _of_scene(scene: Scene) -> Iterator[tuple[Case, Edited]]:
    frames = read_frames(scene.folder)
    request = StageRequest(labels=scene.labels, spine_axis=scene.spine_axis)
    measurer = StageMeasurer(scene.rig)
    found = measurer.measure(*frames, request)
    if {flag.code for flag in found.flags} & UNFIT:
        return
    rng = np.random.default_rng(7)
    for case in CASES:
        for index in range(len(scene.triads)):
            edited = _edited(measurer, frames, request, scene, found, case, index, rng)
            if edited is not None:
                yield case, edited


def _edited(
    measurer: StageMeasurer,
    frames: tuple[Frame, Frame],
    request: StageRequest,
    scene: Scene,
    found: StageMeasurement,
    case: Case,
    index: int,
    rng: np.random.Generator,
) -> Edited | None:
    triad, view = scene.triads[index], int(rng.integers(2))
    side = SIDES[view]
    visible = sorted(triad.visible_in[side])
    if len(visible) < case.balls:
        return None
    radius = np.array(measurer._detector.views[view].ball_px) / 2
    hand = measurer.parameters.centres.manual_sd * radius
    names = rng.permutation(visible)[: case.balls]
    true_px = np.array([triad.centre_px[name][side] for name in names])
    offset = np.array([case.shift_px * rng.choice([-1, 1]), 0.0])
    placed = true_px + offset + rng.normal(0, hand, (case.balls, 2))
    detections = [found.left, found.right]
    at = same_ball(detections[view].features.xy_px, true_px, radius, measurer.parameters.centres.merge_radius)
    if not case.detected:
        detections[view] = _without(detections[view], np.asarray(~at.any(axis=1)))
        edits = [CentreEdit(None, (float(u), float(v))) for u, v in placed]
    elif not at.any(axis=0).all():
        return None
    else:
        edits = [
            CentreEdit(int(k), (float(u), float(v)))
            for k, (u, v) in zip(at.argmax(axis=0), placed, strict=True)
        ]
    changes = ([], edits) if view else (edits, [])
    features = detections[0].features, detections[1].features
    edited = measurer.edit((detections[0], detections[1]), features, changes)
    after = measurer.match(edited, frames, request)
    moved = moved_triad_flags(_full_view(found), [one.triad for one in after.triads])
    codes = frozenset(flag.code for flag in (*after.flags, *moved))
    poses = [one.triad.pose for one in after.triads if one.triad.pose is not None]
    offsets = [pose.position_mm - triad.position_mm for pose in poses]
    near = [k for k, d in enumerate(offsets) if np.linalg.norm(d) < NEAR_MM]
    if not near:
        return Edited(codes, np.nan, np.nan)
    k = min(near, key=lambda i: float(np.linalg.norm(offsets[i])))
    d, S = offsets[k], poses[k].covariance[:3, :3]
    return Edited(codes, float(np.linalg.norm(d)), float(np.sqrt(d @ np.linalg.solve(S, d) / 3)))


def _full_view(found: StageMeasurement) -> list[EarlierTriad]:
    return [
        EarlierTriad(
            one.triad.pose,
            {
                "left": np.array([ball.left_px for ball in one.triad.balls.values()]),
                "right": np.array([ball.right_px for ball in one.triad.balls.values()]),
            },
        )
        for one in found.triads
        if one.triad.pose is not None and not any(ball.hidden_in for ball in one.triad.balls.values())
    ]


def _without(detection: Detection, kept: Bool) -> Detection:
    return replace(detection, features=detection.features.take(np.flatnonzero(kept)))


if __name__ == "__main__":
    sys.exit(main())
