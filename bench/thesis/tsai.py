"""Section 7.2: Tsai's method beside collinearity, with the sensor's horizontal scale sx given, wrong, or estimated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from bench.calibration_boards import moved_board
from bench.peers.tsai import tsai_two_stage
from bench.tables import Bar, Grid
from bench.thesis.calibration import table_shot
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.camera import Rig
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.planning.field_view import visible_in_both
from spinewatch.simulation.rigs import table_3_3_rig

RUNS = 8
SIGMA_PX = 0.05
ASPECT, WRONG_ASPECT = 0.845, 0.83

Solve = Callable[[Shot, Sensor], Rig]


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the comparison of the methods, and the bars on it."""
    rows, found = [], {}
    for name, solve in METHODS.items():
        for aspect in (ASPECT, WRONG_ASPECT):
            rms_px, sd_mm, aspects = _trials(solve, aspect)
            found[name, aspect] = rms_px, float(np.linalg.norm(sd_mm))
            sd = " ".join(f"{x:.3f}" for x in sd_mm)
            rows.append(
                (name, f"{aspect:g}", f"{rms_px:.3f}", sd, f"{aspects.mean():.4f} +- {aspects.std():.4f}")
            )
    grid = Grid.of(
        f"Section 7.2: one shot of the field, {SIGMA_PX} px, four fresh ones, {RUNS} runs; true aspect {ASPECT}",
        ["method", "aspect given", "image RMS px", "fresh sd X Y Z mm", "aspect of the camera"],
        rows,
    )
    tsai, tsai_sx, ours, ours_aspect = METHODS
    best = min(found[tsai, ASPECT][1], found[tsai_sx, ASPECT][1])
    return [grid], [
        Bar(
            "Tsai's sx repairs a wrong aspect",
            f"{found[tsai, WRONG_ASPECT][0]:.2f} to {found[tsai_sx, WRONG_ASPECT][0]:.2f} px",
            found[tsai_sx, WRONG_ASPECT][0] < found[tsai, WRONG_ASPECT][0] / 2,
        ),
        Bar(
            "so does --estimate-aspect, to 0.1 px",
            f"{found[ours, WRONG_ASPECT][0]:.2f} to {found[ours_aspect, WRONG_ASPECT][0]:.2f} px",
            found[ours_aspect, WRONG_ASPECT][0] < 0.1,
        ),
        Bar(
            "Tsai's method is no significant gain over collinearity (section 7.2 asks)",
            f"fresh sd {best:.3f} mm, ours {found[ours, ASPECT][1]:.3f} mm",
            found[ours, ASPECT][1] <= best,
        ),
    ]


def _trials(solve: Solve, aspect: float) -> tuple[float, Float, Float]:
    """Return the image RMS, px, the mean deviations (3,) of fresh shots, mm, and the aspects of the cameras."""
    rng = np.random.default_rng(7)
    rig, field = table_3_3_rig(), pegboard_1995()
    ids = visible_in_both(rig, field)
    control = field.take(ids)
    sensor = Sensor.of_cart(rig.left.image_size_px, aspect)
    rms, sds, aspects = [], [], []
    for _ in range(RUNS):
        placements = [RigidTransform.identity(), *(moved_board(rng, control.mean(axis=0)) for _ in range(4))]
        shots = [
            table_shot(str(k), ids, placement(control), SIGMA_PX, rng)
            for k, placement in enumerate(placements)
        ]
        solved = solve(shots[0], sensor)
        sides = (solved.left, shots[0].left), (solved.right, shots[0].right)
        off = [camera.project(image.control_mm) - image.pixels for camera, image in sides]
        rms.append(np.mean(np.square(off)))
        sds.append(
            [shot_accuracy(solved, s, used=False, defines_object_space=False).sd_mm for s in shots[1:]]
        )
        aspects += [camera.pixel_size_mm[1] / camera.pixel_size_mm[0] for camera, _ in sides]
    return float(np.sqrt(np.mean(rms))), np.mean(sds, axis=(0, 1)), np.array(aspects)


def _tsai(use_scale: bool) -> Solve:
    def solve(shot: Shot, sensor: Sensor) -> Rig:
        left, right = (tsai_two_stage(s, sensor, use_scale=use_scale) for s in (shot.left, shot.right))
        return Rig("Tsai", left, right)

    return solve


def _collinearity(estimate_aspect: bool) -> Solve:
    parameters = SolveParameters(estimate_aspect=estimate_aspect, max_rms_of_width=0.01)
    return lambda shot, sensor: calibrate_stereo([shot], (sensor, sensor), parameters).rig


METHODS: Mapping[str, Solve] = {
    "Tsai": _tsai(use_scale=False),
    "Tsai with sx": _tsai(use_scale=True),
    "collinearity": _collinearity(estimate_aspect=False),
    "collinearity, --estimate-aspect": _collinearity(estimate_aspect=True),
}
