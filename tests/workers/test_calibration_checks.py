"""A stage is judged by the calibrations and the marker scales of the stages before it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta

from contract.stage import MarkerScale, RigCheck
from spinewatch.flags import Flag
from spinewatch.rig_files.rig_json import rig_to_dict
from store.stage_calibrations import EarlierCalibration
from store.stage_work import StageWork
from tests.store.builders import NOON, RIG
from workers.calibration_checks import calibration_flags

OTHER_SIGN = replace(RIG, left=replace(RIG.left, radial=(-RIG.left.radial[0], 0.0)))


def check(scale: float, drifted: bool = False) -> RigCheck:
    measured = MarkerScale(
        distances=12,
        scale=scale,
        sd=0.0011,
        common_sd=0.001,
        p_value=0.01,
        drifted=drifted,
        yaw_deg=0.1,
        base_mm=-1.7,
    )
    return RigCheck(
        balls=12,
        rms_px=0.1,
        p_value=0.5,
        drifted=drifted,
        rotation_deg=[0, 0, 0],
        rotation_sd_deg=[1, 1, 1],
        shift_mm=[0, 0, 0],
        shift_sd_mm=[1, 1, 1],
        marker_scale=measured,
    )


def with_check(name: str, scale: float) -> EarlierCalibration:
    return EarlierCalibration(name, rig_check=json.loads(check(scale).model_dump_json()))


def flags(earlier: Sequence[EarlierCalibration], own: RigCheck | None = None) -> list[Flag]:
    work = StageWork(
        left=b"",
        right=b"",
        sha256={},
        rig={},
        captured_at=None,
        calibrated_at=None,
        calibration_created_at=NOON,
        calibration_age=timedelta(0),
        earlier=(),
        vertebrae=("L1",),
        extra_levels=(),
        spine_axis="x",
        earlier_calibrations=tuple(earlier),
    )
    return list(calibration_flags(work, RIG, own))


def test_a_first_stage_raises_nothing() -> None:
    assert flags([], check(1.0044)) == []


def test_a_lens_of_another_calibration_that_differs_is_flagged() -> None:
    (flag,) = flags([EarlierCalibration("PRE", other_rig=rig_to_dict(OTHER_SIGN))])
    assert flag.code == "lens-differs"
    assert "stage PRE" in flag.detail


def test_another_calibration_of_the_same_lens_raises_nothing() -> None:
    assert flags([EarlierCalibration("PRE", other_rig=rig_to_dict(RIG))], check(1.0)) == []


def test_a_scale_that_stages_show_together_is_flagged() -> None:
    (flag,) = flags([with_check("PRE", 1.0044), with_check("INTER", 1.0046)], check(1.0045))
    assert flag.code == "calibration-drift"
    assert flag.detail.startswith("in the 3 stages of this calibration together, markers measured 1.0045")


def test_sound_scales_raise_nothing() -> None:
    assert flags([with_check("PRE", 1.0015), with_check("INTER", 0.9985)], check(1.001)) == []


def test_a_stage_that_is_flagged_by_itself_is_not_flagged_again() -> None:
    assert flags([with_check("PRE", 1.0044)], check(1.0044, drifted=True)) == []


def test_a_stage_without_a_check_raises_nothing() -> None:
    assert flags([with_check("PRE", 1.01)]) == []
