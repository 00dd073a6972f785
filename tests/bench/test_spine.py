"""The benchmark of the spine on few surgeries, and its counting on constructed values."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench import (
    spine,
    spine_attribution,
    spine_axes,
    spine_bursts,
    spine_cobb,
    spine_coverage,
    spine_invariance,
    spine_planes,
    spine_sample,
    spine_setups,
    spine_thesis,
)
from bench.spine_bursts import Bias, Fall
from bench.spine_cobb import CobbErrors, nearest_curve
from bench.spine_coverage import Coverage
from bench.spine_invariance import Changes
from bench.spine_planes import PlaneTally
from bench.spine_sample import Motion
from bench.spine_surgeries import (
    BASELINE,
    POST,
    STAGES,
    CartMotion,
    Surgery,
    measured_stages,
    moved_to,
    simulated_surgery,
)
from bench.spine_triads import RIG_NOISE, measured_triads, pose_coverage, pose_errors
from bench.spine_truth import CIRCULAR, difference, true_ends, true_reselected, true_value
from bench.tables import Bar
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, triads_on
from spinewatch.simulation.spines import random_spine
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.results import Curve
from spinewatch.triads.pose import Pose
from tests.paths import SAMPLES


@pytest.fixture(scope="module")
def surgery() -> Surgery:
    return simulated_surgery(np.random.default_rng(3), CurveKind.DOUBLE)


def tilted(coronal_deg: list[float]) -> SpinePoses:
    turns = np.zeros((len(LEVELS), 3))
    turns[:, 0] = np.radians(coronal_deg)
    return SpinePoses(np.zeros((len(LEVELS), 3)), rotation_from_vector(turns))


def missed(checks: tuple[Bar, ...]) -> list[str]:
    return [bar.promise for bar in checks if not bar.holds]


# Measured triads


def test_measured_triads_are_near_the_truth_and_lost_outside_the_images() -> None:
    rng = np.random.default_rng(0)
    true = list(random_spine(rng, 4))
    lost = Pose(true[0].position_mm + np.array([0.0, 900.0, 0.0]), true[0].rotation, np.zeros((6, 6)))
    found = measured_triads(large_rig(), [*true, lost], rng)
    assert found[-1] is None
    for t, m in zip(true, found, strict=False):
        assert m is not None
        assert np.linalg.norm(m.position_mm - t.position_mm) < 2
        assert np.all(np.linalg.eigvalsh(m.covariance) > 0)


def test_pointing_errors_can_be_given() -> None:
    rng = np.random.default_rng(0)
    true = list(random_spine(rng, 1)) * 2
    same = np.tile(np.array([[[3.0, 0.0], [3.0, 0.0]]]), (2, 1, 1))
    quiet = replace(RIG_NOISE, sigma_px=1e-4)
    first, second = measured_triads(large_rig(), true, rng, quiet, same)
    assert first is not None
    assert second is not None
    assert np.linalg.norm(first.position_mm - true[0].position_mm) > 0.05
    assert first.position_mm == pytest.approx(second.position_mm, abs=1e-2)


def test_pose_error_is_in_the_convention_of_the_covariance() -> None:
    zero = np.zeros((6, 6))
    turn = rotation_from_vector(np.radians([0.0, 2.0, 0.0]))
    error = pose_errors(Pose(np.ones(3), turn, zero), Pose(np.zeros(3), np.eye(3), zero))
    assert error == pytest.approx([1, 1, 1, 0, 2, 0])


def test_pose_coverage_of_few_triads_has_a_bar() -> None:
    grids, (bar,) = pose_coverage(40)
    assert grids[0].rows[0][0] == "40"
    assert "%" in bar.reached


# Truth


def test_true_ends_and_reselected_angle() -> None:
    coronal = [0.0, -2, -5, -10, -20, -12, -4, 4, 12, 20, 25, 20, 10, 5, 2, 1, 0]
    poses = tilted(coronal)
    assert true_ends(poses, (4.4, 9.6)) == (4, 10)
    curve = Curve("curve 1", "T5", "T8", "T11", "right")
    assert true_reselected(poses, (curve,), "curve 1") == pytest.approx(45)
    assert true_value("cobb-fixed", ("T5", "T10"), poses) == pytest.approx(40)


def test_differences_of_azimuths_go_round() -> None:
    assert difference(CIRCULAR, 179.0, -179.0) == pytest.approx(-2)
    assert difference("cobb-fixed", 179.0, -179.0) == 358


# Surgeries


def test_truth_is_carried_by_the_reference(surgery: Surgery) -> None:
    row = LEVELS.index(surgery.reference)
    before, after = surgery.truth(BASELINE), surgery.truth(POST)
    assert after.position_mm[row] == pytest.approx(np.zeros(3), abs=1e-9)
    assert after.rotation[row] == pytest.approx(before.rotation[row])
    moved = moved_to(surgery, np.random.default_rng(0), CartMotion(10.0, 100.0))
    assert not np.allclose(moved.bodies[POST].position_mm, surgery.bodies[POST].position_mm, atol=1)
    assert moved.truth(POST).position_mm == pytest.approx(after.position_mm, abs=1e-9)


def test_poses_in_patient_axes_return_to_object_space(surgery: Surgery) -> None:
    back = surgery.in_object_space(POST, surgery.spines[POST].poses)
    assert back.position_mm == pytest.approx(surgery.bodies[POST].position_mm)
    assert back.rotation == pytest.approx(surgery.bodies[POST].rotation)
    triads = triads_on(back, surgery.mounts)
    assert triads["L5"].position_mm == pytest.approx(surgery.triads[POST]["L5"].position_mm)


def test_stages_are_measured(surgery: Surgery) -> None:
    (stages,) = measured_stages([surgery], np.random.default_rng(0))
    assert list(stages) == list(STAGES)
    for stage in STAGES:
        for level, pose in stages[stage].items():
            assert np.linalg.norm(pose.position_mm - surgery.triads[stage][level].position_mm) < 3


# The controlled test of section 6.3


def test_equation_6_1_misses_a_coronal_tilt_and_the_full_motion_does_not() -> None:
    found = spine_thesis.trials(20)
    coronal = found[0]
    assert coronal.truth.tilts_deg() == pytest.approx([20, 0, 0])
    assert coronal.thesis.tilts_deg() == pytest.approx([0, 0, 0], abs=1e-9)
    assert coronal.ours.tilts_deg() == pytest.approx([20, 0, 0])
    axial = found[2]
    # The offset of 40 mm is not turned by 20 degrees: a chord of 2 x 40 sin(10).
    assert axial.thesis.errors(axial.truth)[1] == pytest.approx(80 * math.sin(math.radians(10)))
    assert axial.ours.errors(axial.truth) == pytest.approx((0, 0), abs=1e-9)
    grids, checks = spine_thesis.grids_and_bars(found)
    assert len(grids[0].rows) == len(spine_thesis.MOTIONS)
    assert all(bar.holds for bar in checks[:3])
    wrong = [replace(coronal, ours=coronal.thesis, covered=(80.0, 80.0)), *found[1:]]
    assert len(missed(spine_thesis.grids_and_bars(wrong)[1])) >= 1


# Cobb angles without noise


def test_cobb_of_marked_end_vertebrae_is_exact() -> None:
    found = spine_cobb.cobb_errors(2)
    ends = [t for t in found if t.markers == "end vertebrae and apices" and t.initial == "all levels"]
    assert len(ends) == 3
    assert max(t.rms("cobb-fixed") for t in ends) < 1e-6
    grids, checks = spine_cobb.grids_and_bars(found)
    assert len(grids[0].rows) == len(found)
    assert len(checks) == 5


def test_cobb_bars_can_be_missed() -> None:
    bad = []
    for markers in ("end vertebrae and apices", "every second level", "T7 T9 T11 L1"):
        tally = CobbErrors("thoracic", markers, "all levels")
        for errors in tally.errors_deg.values():
            errors += [5.0, 5.0]
        tally.inside["cobb-fixed"] += [True] * 9 + [False]
        tally.status["cobb-fixed", "measured"] = 2
        bad.append(tally)
    _, checks = spine_cobb.grids_and_bars(bad)
    assert len(missed(checks)) == 5


def test_nearest_curve_must_overlap() -> None:
    curves = (Curve("curve 1", "T1", "T3", "T5", "left"), Curve("curve 2", "T5", "T8", "T11", "right"))
    assert nearest_curve(curves, 4, 9) is curves[1]
    assert nearest_curve(curves, 12, 16) is None


# Coverage


def test_coverage_of_few_surgeries() -> None:
    found = spine_coverage.coverage(3)
    assert found.surgeries == 3
    assert ("stage", "cobb-fixed", "measured") in found.tallies
    assert ("motion", "coronal tilt", "measured") in found.tallies
    assert any(when == "attribution" for when, _, _ in found.tallies)
    grids, checks = spine_coverage.grids_and_bars(found)
    assert len(grids[0].rows) == len(found.tallies)
    assert len(checks) == 6


def test_coverage_counts_per_measure() -> None:
    found = Coverage(surgeries=100)
    for when, sd in (("baseline", 2.0), ("stage", 2.0), ("change", 1.0)):
        for i in range(100):
            found.tallies[when, "cobb-fixed", "measured"].add((-1) ** i * sd, sd, inside=i < 95)
    for name in ("motion", "attribution"):
        found.tallies[name, "x mm", "measured"].add(0.0, 1.0, inside=True)
    assert found.tallies["stage", "cobb-fixed", "measured"].inside_pct == 95
    _, checks = spine_coverage.grids_and_bars(found)
    # One value that is inside is 100%, above the range.
    assert missed(checks) == [
        "95% intervals hold 93-97%, every part of a motion",
        "95% intervals hold 93-97%, every part of the attribution",
    ]
    found.tallies["change", "cobb-fixed", "measured"].sd[:] = [3.0] * 100
    assert "change of Cobb has a smaller deviation than Cobb itself" in missed(
        spine_coverage.grids_and_bars(found)[1]
    )


# Patient axes that err


def test_axes_that_err_are_drawn_beside_the_poses(surgery: Surgery) -> None:
    exact, erring = (surgery.uncertain_setup(np.random.default_rng(1), 1.0, 1.5, sd) for sd in (0.0, 3.0))
    assert np.array_equal(exact.patient_axes, surgery.patient_axes)
    assert not exact.axes_covariance_deg2.any()
    assert np.allclose(exact.initial.position_mm, erring.initial.position_mm)
    assert np.array_equal(erring.axes_covariance_deg2, 9 * np.eye(3))
    off = surgery.patient_axes.T @ erring.patient_axes
    assert 0.5 < np.degrees(np.linalg.norm(vector_from_rotation(off))) < 12
    patient = surgery.uncertain_setup(np.random.default_rng(1), 1.0, 1.5, 3.0, "patient")
    # What was typed in is right in the axes that are stated.
    assert np.allclose(
        patient.patient_axes.T @ patient.initial.rotation,
        exact.patient_axes.T @ exact.initial.rotation,
        atol=0.1,
    )


def test_rates_of_wrong_axes_on_few_surgeries() -> None:
    found = spine_axes.rates(4)
    grid, checks = spine_axes.grid_and_bars_of_rates(found)
    assert [found.setups[given] for given in spine_axes.GIVEN] == [4, 4, 4]
    assert len(grid.rows) == 1 + len(spine_axes.TURNS)
    assert missed(checks[:3]) == []
    seen = found.flagged["object axes", "30 deg about z"] + found.refused["object axes", "30 deg about z"]
    assert seen >= 3


def test_rates_count_false_alarms_and_refusals() -> None:
    found = spine_axes.Rates()
    for given in spine_axes.GIVEN:
        found.setups[given] = 100
        for turn in spine_axes.TURNS:
            found.refused[given, turn] = 80
    assert missed(spine_axes.grid_and_bars_of_rates(found)[1]) == []
    found.flagged["object axes", ""] = 2
    found.refused["patient axes", ""] = 1
    found.refused["patient axes", "20 deg about x"] = 79
    assert len(missed(spine_axes.grid_and_bars_of_rates(found)[1])) == 3


# Mistakes in setups


def test_rates_of_mistakes_on_few_surgeries() -> None:
    found = spine_setups.rates(6)
    grids, checks = spine_setups.grids_and_bars(found)
    assert sum(found.setups.values()) + 1 >= 6
    assert [row[0] for row in grids[0].rows][:2] == ["sound", "left and right"]
    assert {"still", "settled", "moved"} <= {row[0] for row in grids[1].rows}
    assert missed(checks[:2]) == []


def test_rates_of_mistakes_count_alarms_and_what_is_seen() -> None:
    found = spine_setups.Rates()
    found.setups["large"] = found.setups["small"] = 100
    for counts, name in (
        (found.poses, "left and right"),
        (found.poses, "both"),
        (found.tilts, "coronal tilts 0"),
    ):
        counts["large", name] = 90
    for name in ("still", "settled", "lost"):
        found.clamped[name] = 100
    found.clamped_seen["lost"] = 90
    assert missed(spine_setups.grids_and_bars(found)[1]) == []
    found.poses["small", ""] = 2
    found.tilts["large", "coronal tilts 0"] = 70
    found.clamped_seen["settled"] = 1
    assert len(missed(spine_setups.grids_and_bars(found)[1])) == 3


# Planes of small curves


def test_planes_of_few_small_curves() -> None:
    found = spine_planes.planes(4)
    assert len(found) == len(spine_planes.RATIOS) * len(spine_planes.PLANES) * len(spine_planes.SIZES)
    assert all(tally.reported_pct == 100 for tally in found if tally.size == 8 and tally.ratio == 1)
    grids, checks = spine_planes.grids_and_bars(found)
    assert len(grids[0].rows) == len(found)
    assert len(checks) == 3


def test_bars_of_planes_can_be_missed() -> None:
    good = PlaneTally(3.0, "coronal", 8.0, [*[True] * 95, *[False] * 5], [True] * 95 + [False] * 5)
    straight = PlaneTally(3.0, "coronal", 0.0, [None] * 98 + [False] * 2, [True] * 95 + [False] * 5)
    assert (straight.reported_pct, straight.inside_pct, straight.wrong_pct) == (2.0, 0.0, 2.0)
    assert not missed(spine_planes.grids_and_bars([good, straight])[1])
    bad = PlaneTally(3.0, "coronal", 8.0, [*[True] * 9, False], [True] * 8 + [False] * 2)
    assert len(missed(spine_planes.grids_and_bars([bad])[1])) == 3


# Attribution


def test_attribution_of_known_manoeuvres() -> None:
    found = spine_attribution.parts_of_manoeuvres(2)
    by_key = {(p.manoeuvre, p.quantity): p for p in found}
    opened = by_key["distraction by 15 mm", "lateral-displacement"]
    assert opened.distraction == pytest.approx(opened.total, abs=0.1)
    assert by_key["derotation by half", "cobb-fixed"].total < 1e-9
    _, checks = spine_attribution.grids_and_bars(found)
    assert len(checks) == 2
    turned = [replace(p, rotation=p.distraction, distraction=p.rotation) for p in found]
    assert len(missed(spine_attribution.grids_and_bars(turned)[1])) == 2


# Bursts


def test_bursts_of_few_surgeries() -> None:
    found = spine_bursts.falls(3)
    assert [f.pairs for f in found] == list(spine_bursts.PAIRS) * 2
    assert found[3].rms_deg < found[0].rms_deg
    assert found[3].stated_deg < found[0].stated_deg / 4


def test_breathing_is_averaged_by_a_burst() -> None:
    found = {bias.definition: bias for bias in spine_bursts.biases(3)}
    assert found["kyphosis"].single > 0.2
    assert found["kyphosis"].spread < found["kyphosis"].single


def test_burst_bars_can_be_missed() -> None:
    good = [Fall("noise", n, 1 / math.sqrt(n), 1 / math.sqrt(n), 1 / math.sqrt(n), 95.0) for n in (1, 4)]
    fine = [Bias("kyphosis", 10, 0.1, 0.1, 0.1, 0.5, 95.0)]
    assert not missed(spine_bursts.grids_and_bars(good, fine)[1])
    flat = [replace(fall, rms_deg=1.0, stated_deg=0.5, inside_pct=80.0) for fall in good]
    biased = [replace(fine[0], worst=0.3)]
    assert len(missed(spine_bursts.grids_and_bars(flat, biased)[1])) == 4


# Sample and invariance


def test_motion_of_the_sample_surgery_is_in_its_intervals() -> None:
    motions = spine_sample.sample_motions(SAMPLES / "D1")
    assert {(m.of, m.stage, m.vertebra) for m in motions} == {
        (of, stage, vertebra)
        for of in ("triad", "body")
        for stage in ("INTER", "POST")
        for vertebra in ("T11", "T9", "T7")
    }
    _, checks = spine_sample.grids_and_bars(motions)
    assert not missed(checks)
    far = tuple(Motion(m.of, m.stage, m.vertebra, m.error + 10 * m.sd, m.sd) for m in motions)
    assert len(missed(spine_sample.grids_and_bars(far)[1])) == 2


def test_turning_the_rig_changes_no_measure() -> None:
    found = spine_invariance.changes(1)
    assert found.values > 30
    assert not missed(spine_invariance.grids_and_bars(found)[1])
    assert len(missed(spine_invariance.grids_and_bars(Changes(1e-6, 1e-6, 1e-6, 1))[1])) == 3


# The command


def test_command_prints_bars_and_writes_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "bars.json"
    assert spine.main(["--part", "sample", "--check", "--json", str(file)]) == 0
    assert "Bars" in capsys.readouterr().out
    assert "sample surgery" in file.read_text()
