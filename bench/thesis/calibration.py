"""Chapter 3: the camera geometry, the control field, the parameters and the accuracy of reconstruction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.calibration_boards import moved_board
from bench.tables import Bar, Grid
from bench.thesis.printed import printed
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.quality.stereo_geometry import stereo_geometry
from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.planning.field_view import visible_in_both
from spinewatch.rig_files.plate_origin import about_principal_point
from spinewatch.simulation.rigs import table_3_3_rig

TYPICAL = tuple(str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18))
"""The subset of fig. 3.3: three rows of four points."""

TABLE_3_4_MM = np.array([0.3378, 0.3451, 0.6595])
DIGITIZED_PX = 1 / np.sqrt(12)
"""Standard deviation of a coordinate that is digitized to whole pixels, as control points were, px."""

PLACED_MM = np.array([1 / np.sqrt(12), 1 / np.sqrt(12), 0.0])
"""Standard deviation of a peg from its place per axis, mm: set to whole mm in X and Y, whose nominal values Table 3.2
has; heights were measured to 0.001 mm."""

TOLERANCE = 0.15
RUNS = 60


def part() -> tuple[Sequence[Grid], Sequence[Bar]]:
    """Return the tables and bars of chapter 3."""
    accuracy, bar = _table_3_4()
    return [_table_3_1(), _table_3_3(), accuracy], [*_table_3_2(), *_simulated_heights(), bar]


def _table_3_1() -> Grid:
    rig = table_3_3_rig()
    geometry = stereo_geometry(rig, pegboard_1995().take(TYPICAL))
    near, far = geometry.range_mm
    rows = [
        ("range, mm", "630-760", f"{near:.0f} and {far:.0f} to the middle of the board"),
        ("focal length, mm", "7-7.5", f"{rig.left.focal_length_mm:.2f}, {rig.right.focal_length_mm:.2f}"),
        ("field of view, mm", "500 x 400", " x ".join(f"{x:.0f}" for x in geometry.field_of_view_mm)),
        ("baseline, mm", "300-500", f"{rig.baseline_mm:.0f}"),
        (
            "vergence, degrees",
            "15-20",
            f"{rig.vergence_deg:.1f}; the text of section 5.4 has 32 for this baseline",
        ),
    ]
    return Grid.of("Table 3.1: general geometry, and that of trial C", ["", "thesis", "here"], rows)


def _table_3_3() -> Grid:
    rig = table_3_3_rig()
    rows = []
    for side, camera in (("left", rig.left), ("right", rig.right)):
        converted = about_principal_point(camera)
        c = converted.camera
        x0, y0 = c.principal_point_mm
        rows.append(
            (side, f"{camera.focal_length_mm:.3f}", f"{camera.radial[0]:.2e}", f"{c.focal_length_mm:.4f}",
             f"{c.radial[0]:.3e}", f"{x0:.4f} {y0:.4f}", f"{converted.fit_error_px:.3f}")
        )  # fmt: skip
    return Grid.of(
        "Table 3.3: K1 about the plate's origin, and the nearest camera about the principal point",
        ["camera", "f mm, printed", "K1 mm^-2, printed", "f mm", "K1 mm^-2", "x0 y0 mm", "max error px"],
        rows,
    )


def table_shot(
    name: str, ids: tuple[str, ...], built: Float, sigma_px: float, rng: np.random.Generator
) -> Shot:
    """Return a shot of pegs at ``built`` (n, 3) by the rig of Table 3.3, with noise, given their coordinates."""
    return _shot(name, ids, built, pegboard_1995().take(ids), sigma_px, rng)


def _shot(
    name: str, ids: tuple[str, ...], built: Float, control: Float, sigma_px: float, rng: np.random.Generator
) -> Shot:
    rig = table_3_3_rig()
    left, right = (
        ImagePoints.build(ids, control, c.project(built) + sigma_px * rng.standard_normal((len(ids), 2)))
        for c in (rig.left, rig.right)
    )
    return Shot(name, left, right)


def _table_3_2() -> list[Bar]:
    """Project the board of Table 3.2 through the cameras of Table 3.3, and solve back."""
    rig, field = table_3_3_rig(), pegboard_1995()
    seen = visible_in_both(rig, field)
    shot = table_shot("exact", TYPICAL, field.take(TYPICAL), 0.0, np.random.default_rng(0))
    solved = calibrate_stereo([shot], (_sensor(),) * 2).rig
    off = max(
        float(np.abs(camera_vector(a) - camera_vector(b)).max())
        for a, b in ((solved.left, rig.left), (solved.right, rig.right))
    )
    return [
        Bar("Table 3.3: baseline 422 mm, vergence 32.2 degrees",
         f"{rig.baseline_mm:.1f} mm, {rig.vergence_deg:.2f} degrees",
         round(rig.baseline_mm) == 422 and round(rig.vergence_deg, 1) == 32.2),
        Bar("Table 3.2: points 3-6, 9-12, 15-18 in both images", ",".join(seen), seen == TYPICAL),
        Bar("solving back is exact without noise", f"largest parameter error {off:.1e}", off < 1e-6),
    ]  # fmt: skip


def _simulated_heights() -> list[Bar]:
    """Solve with the simulated heights of Table 3.2 as with the built ones, with noise."""
    heights = {str(row["point"]): (row["X"], row["Y"], row["Z_sim"]) for row in printed("table_3_2")}
    points = np.array([heights[id_] for id_ in TYPICAL], dtype=np.float64)
    rng = np.random.default_rng(32)
    converged = 0
    for _ in range(20):
        shot = _shot("simulated", TYPICAL, points, points, DIGITIZED_PX, rng)
        rig = calibrate_stereo([shot], (_sensor(),) * 2, _parameters()).rig
        converged += abs(rig.baseline_mm - table_3_3_rig().baseline_mm) < 10
    return [Bar("Table 3.2, simulated heights: 20 runs with noise converge", f"{converged}", converged == 20)]


def _table_3_4() -> tuple[Grid, Bar]:
    """Simulate the five trials by one error model: whole pixels, and pegs set to whole millimetres."""
    rng = np.random.default_rng(34)
    control = pegboard_1995().take(TYPICAL)
    runs: list[Float] = []
    for _ in range(RUNS):
        built = control + PLACED_MM * rng.standard_normal(control.shape)
        placements = [RigidTransform.identity(), *(moved_board(rng, control.mean(axis=0)) for _ in range(4))]
        shots = [
            table_shot(n, TYPICAL, p(built), DIGITIZED_PX, rng)
            for n, p in zip("CABDE", placements, strict=True)
        ]
        rig = calibrate_stereo(shots[:1], (_sensor(),) * 2, _parameters()).rig
        accuracy = [
            shot_accuracy(rig, s, used=s is shots[0], defines_object_space=s is shots[0]) for s in shots
        ]
        runs.append(np.mean([a.sd_mm for a in accuracy], axis=0))
    mean = np.mean(runs, axis=0)
    ratio = mean / TABLE_3_4_MM
    grid = Grid.of(
        f"Table 3.4: mean over five trials, {RUNS} runs; pixels digitized to whole numbers, pegs set to whole mm",
        ["", "X mm", "Y mm", "Z mm"],
        [("thesis", *(f"{v:.3f}" for v in TABLE_3_4_MM)), ("simulated", *(f"{v:.3f}" for v in mean))],
    )
    reached = " / ".join(f"{r - 1:+.1%}" for r in ratio)
    return grid, Bar(
        f"Table 3.4 within {TOLERANCE:.0%}", reached, bool(np.all(np.abs(ratio - 1) <= TOLERANCE))
    )


def _parameters() -> SolveParameters:
    return SolveParameters(
        max_rms_of_width=0.01, free=("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1")
    )


def _sensor() -> Sensor:
    return Sensor.of_camera(table_3_3_rig().left)
