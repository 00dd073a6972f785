import re
from typing import Any

import pytest

from commands.shared.surgery_tables import print_flags, print_motion, print_triads


def test_a_triad_without_a_label_has_a_question_mark(capsys: pytest.CaptureFixture[str]) -> None:
    triad = {
        "label": None,
        "position_mm": [1, 2, 3],
        "position_sd_mm": [0.1, 0.2, 0.3],
        "angles_deg": [90, 91, 5],
        "rotation_sd_deg": [1, 2, 0.5],
        "error_mm": 0.25,
    }
    print_triads({"PRE": {"frame": "object space of calibration c", "triads": [triad]}})
    out = capsys.readouterr().out
    assert re.search(
        r"PRE\s+\?\s+1\.00±0\.10\s+2\.00±0\.20\s+3\.00±0\.30\s+90\.0\s+91\.0\s+5\.0\s+±2\.0\s+0\.25", out
    )
    assert "in object space of calibration c" in out


def test_a_triad_without_a_pose_has_dashes(capsys: pytest.CaptureFixture[str]) -> None:
    triad = {"label": "T9", "position_mm": None}
    print_triads({"PRE": {"frame": "object space", "triads": [triad]}})
    assert re.search(r"PRE\s+T9(\s+-){8}", capsys.readouterr().out)


def test_motion_and_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    moved = {
        "vertebra": "T11",
        "translation_mm": [1, 2, 3],
        "translation_sd_mm": [0.1, 0.2, 0.3],
        "rotation_vector_deg": [4, 5, 6],
        "rotation_sd_deg": [0.4, 0.5, 0.6],
        "angle_deg": 8.77,
        "angle_sd_deg": 0.5,
        "angle_interval_deg": [7.73, 9.72],
    }
    motion = {
        "from": {"name": "PRE"},
        "to": {"name": "POST"},
        "frame": "reference triad L1",
        "vertebrae": [moved],
        "missing": [{"vertebra": "T9", "reason": "no triad is labelled T9 in POST"}],
    }
    print_motion(motion)
    out = capsys.readouterr().out
    assert re.search(
        r"T11\s+1\.00±0\.10\s+2\.00±0\.20\s+3\.00±0\.30\s+4\.0±0\.4\s+5\.0±0\.5\s+6\.0±0\.6\s+8\.8 \(7\.7 to 9\.7\)",
        out,
    )
    assert "T9: no triad is labelled T9 in POST" in out
    assert "in the frame of reference triad L1" in out


def test_flags_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    stages: dict[str, Any] = {
        "PRE": {"flags": [{"code": "few", "detail": "two balls"}]},
        "POST": {"flags": None},
    }
    jobs: dict[str, Any] = {
        "PRE": {"error": None},
        "POST": {"state": "failed", "error": {"detail": "damaged"}},
    }
    print_flags(stages, jobs)
    assert capsys.readouterr().out.splitlines() == ["PRE: two balls [few]", "POST: failed: damaged"]
