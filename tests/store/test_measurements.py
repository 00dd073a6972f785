import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import event, inspect

from contract.revision import Remeasurement
from contract.triad import Triad
from store import measurements, stage_submission, stages
from store.database import Database
from store.errors import NotFoundError, StageNotMeasuredError
from store.page import PageRequest
from tests.store.builders import (
    CLIENT,
    RIG_CHECK,
    at,
    claimed,
    measured_take,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
    triad,
    without_pose,
)

LABELS = [triad("L1"), triad(None, label_reason="the gaps do not decide"), triad("T11")]


def test_what_is_stored_is_what_comes_out(database: Database) -> None:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)
    result = stage_result([*LABELS, without_pose("T9")], rig_check=RIG_CHECK)
    succeed(database, claimed(database, stage.job.id), result=result)
    with database.read() as session:
        _, measured = measurements.get(session, surgery, "PRE")
        triads = measurements.triads(session, stage.id)
        features = measurements.features(session, stage.id)
        assert measurements.burst(session, stage.id) is None
    assert triads == result.triads
    assert features == result.features
    assert measured.result == result.model_dump(mode="json", exclude={"features", "triads", "burst"})
    assert measured.triad_count == 4
    assert (measured.left_count, measured.right_count) == (2, 1)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3))
def test_numbers_pass_through_json_to_the_last_bit(position: list[float]) -> None:
    made = Triad.model_validate(triad("L1", position_mm=position))
    again = Triad.model_validate(json.loads(json.dumps(made.model_dump(mode="json"))))
    assert again == made
    assert np.array(again.position_mm).tobytes() == np.array(position).tobytes()


def test_poses_are_those_of_the_labelled_triads(database: Database) -> None:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)
    with pytest.raises(StageNotMeasuredError, match="queued"), database.read() as session:
        measurements.get(session, surgery, "PRE")
    succeed(database, claimed(database, stage.job.id), result=stage_result([*LABELS, without_pose("T9")]))
    with database.read() as session:
        poses = measurements.poses(session, stage.id)
    assert list(poses) == ["L1", "T11"]
    assert poses["L1"].position_mm == pytest.approx([1, 2, 3])
    assert poses["L1"].rotation == pytest.approx(np.eye(3))
    assert poses["L1"].covariance.shape == (6, 6)


def test_a_stage_that_does_not_exist(database: Database) -> None:
    surgery = new_surgery(database)
    with database.read() as session, pytest.raises(NotFoundError, match="stage"):
        measurements.get(session, surgery, "PRE")


def test_a_list_of_stages_counts_triads_without_loading_them(database: Database) -> None:
    surgery = new_surgery(database)
    succeed(database, claimed(database, new_stage(database, surgery).job.id))
    statements: list[str] = []
    event.listen(database.engine, "before_cursor_execute", lambda *arguments: statements.append(arguments[2]))
    with database.read() as session:
        (stage,) = stages.listed(session, surgery, PageRequest()).items
    assert stage.measurement is not None
    assert stage.measurement.triad_count == 2
    assert not any("triads.triad" in statement or "features.points" in statement for statement in statements)


def test_a_triad_of_a_stage_without_a_measurement_is_refused(database: Database) -> None:
    keys = inspect(database.engine).get_foreign_keys("triads")
    assert [(key["constrained_columns"], key["referred_table"], key["referred_columns"]) for key in keys] == [
        (["stage_id"], "measurements", ["stage_id"])
    ]


def test_a_burst_comes_out_as_it_went_in(database: Database) -> None:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)
    pair = {"view_delay_s": 0.1, "poses": {}, "outliers": [], "labelled_by": None, "flags": []}
    burst = {
        "pairs": [{**pair, "offset_s": 0.0}, {**pair, "offset_s": 1.0, "outliers": ["L1"]}],
        "breathing": None,
        "pairs_used": {"L1": 1},
        "shared_position_share": 0.5,
        "shared_rotation_share": 0.25,
        "parameters": {},
    }
    result = stage_result(burst=burst)
    succeed(database, claimed(database, stage.job.id), result=result)
    with database.read() as session:
        _, measured = measurements.get(session, surgery, "PRE")
        assert measurements.burst(session, stage.id) == result.burst
    assert "burst" not in measured.result


def test_own_parameters_are_those_of_the_latest_take_that_is_no_revision(database: Database) -> None:
    surgery = new_surgery(database)

    def own(take: int) -> dict[str, object]:
        with database.read() as session:
            return measurements.own_parameters(session, stages.get(session, surgery, "PRE", take))

    def revise(take: int) -> None:
        changes = Remeasurement(kind="measure", take=take)
        with database.write() as session:
            revised = stage_submission.revise(session, surgery, "PRE", changes, at(5), CLIENT)
        result = stage_result(parameters={"ball_diameter_mm": 1.0 + take})
        succeed(database, claimed(database, revised.job.id), result=result)

    measured_take(database, surgery, b"1", 0)
    revise(1)
    revise(2)
    measured_take(database, surgery, b"2", 1, retake=True)
    revise(4)
    assert [own(take) for take in (1, 3, 5)] == [{"ball_diameter_mm": 8.0}] * 3
