"""Tables 3.2 to 3.4 of the thesis, recomputed."""

from __future__ import annotations

import numpy as np

from bench.calibration_boards import moved_board
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.planning.control_field_trial import visible_in_both
from spinewatch.simulation.rigs import table_3_3_rig

TYPICAL = tuple(str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18))
TABLE_3_4_MM = np.array([0.3378, 0.3451, 0.6595])
SIGMA_PX, PEG_MM, RUNS = 0.22, 0.36, 100


def table_3_2() -> list[Bar]:
    """Project the board of Table 3.2 through the cameras of Table 3.3, and solve back."""
    rig, field = table_3_3_rig(), pegboard_1995()
    seen = visible_in_both(rig, field)
    calibration = calibrate_stereo(
        [table_shot("exact", TYPICAL, field.take(TYPICAL), 0.0, np.random.default_rng(0))], (_sensor(),) * 2
    )
    off = max(
        float(np.abs(camera_vector(a) - camera_vector(b)).max())
        for a, b in ((calibration.rig.left, rig.left), (calibration.rig.right, rig.right))
    )
    return [
        Bar("Table 3.3: baseline 422 mm, vergence 32.2 degrees",
         f"{rig.baseline_mm:.1f} mm, {rig.vergence_deg:.2f} degrees",
         round(rig.baseline_mm) == 422 and round(rig.vergence_deg, 1) == 32.2),
        Bar("points 3-6, 9-12, 15-18 in both images", ",".join(seen), seen == TYPICAL),
        Bar("solving back is exact without noise", f"largest parameter error {off:.1e}", off < 1e-6),
    ]  # fmt: skip


def table_3_4() -> list[Bar]:
    """Simulate the five trials: a board whose pegs differ from their coordinates is moved; one shot is used."""
    rng = np.random.default_rng(34)
    control = pegboard_1995().take(TYPICAL)
    parameters = SolveParameters(
        max_rms_of_width=0.01, free=("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1")
    )
    runs: list[Float] = []
    for _ in range(RUNS):
        built = control + PEG_MM * rng.standard_normal(control.shape)
        placements = [RigidTransform.identity(), *(moved_board(rng, control.mean(axis=0)) for _ in range(4))]
        shots = [
            table_shot(n, TYPICAL, p(built), SIGMA_PX, rng) for n, p in zip("CABDE", placements, strict=True)
        ]
        rig = calibrate_stereo(shots[:1], (_sensor(),) * 2, parameters).rig
        accuracy = [
            shot_accuracy(rig, s, used=s is shots[0], defines_object_space=s is shots[0]) for s in shots
        ]
        runs.append(np.mean([a.sd_mm for a in accuracy], axis=0))
    mean = np.mean(runs, axis=0)
    ratio = mean / TABLE_3_4_MM
    Grid.of(
        f"Table 3.4 from {SIGMA_PX} px and {PEG_MM} mm, {RUNS} runs of five trials",
        ["", "X mm", "Y mm", "Z mm"],
        [("thesis", *(f"{v:.3f}" for v in TABLE_3_4_MM)), ("simulated", *(f"{v:.3f}" for v in mean))],
    ).print()
    return [
        Bar(
            "Table 3.4 within 10%",
            " / ".join(f"{r - 1:+.1%}" for r in ratio),
            bool(np.all(np.abs(ratio - 1) <= 0.1)),
        )
    ]


def _sensor() -> Sensor:
    camera = table_3_3_rig().left
    return Sensor(camera.image_size_px, camera.pixel_size_mm)


def table_shot(
    name: str, ids: tuple[str, ...], built: Float, sigma_px: float, rng: np.random.Generator
) -> Shot:
    """Return a shot of pegs at ``built`` (n, 3) by the rig of Table 3.3, with noise, given their coordinates."""
    rig, control = table_3_3_rig(), pegboard_1995().take(ids)
    left, right = (
        ImagePoints.build(ids, control, c.project(built) + sigma_px * rng.standard_normal((len(ids), 2)))
        for c in (rig.left, rig.right)
    )
    return Shot(name, left, right)
