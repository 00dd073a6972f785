from contract.job import JobState
from contract.revision import Remeasurement
from contract.stage import RigCheck
from store import calibrations, stage_submission, surgeries
from store.database import Database
from store.stage_calibrations import EarlierCalibration, earlier_calibrations
from store.stage_submission import NewStage
from store.tables.stages import Stage
from tests.store.builders import (
    CLIENT,
    NOON,
    RIG,
    at,
    claimed,
    end,
    image,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
)


def new_calibration(database: Database) -> str:
    with database.write() as session:
        return calibrations.add(session, RIG, NOON, CLIENT).id


def checked(balls: int) -> RigCheck:
    zero = [0.0, 0.0, 0.0]
    return RigCheck(
        balls=balls,
        rms_px=0.1,
        p_value=0.5,
        drifted=False,
        rotation_deg=zero,
        rotation_sd_deg=zero,
        shift_mm=zero,
        shift_sd_mm=zero,
    )


def measure(database: Database, stage: Stage, balls: int) -> None:
    assert succeed(
        database, claimed(database, stage.job.id), result=stage_result([], rig_check=checked(balls))
    )


def found(database: Database, stage: Stage) -> tuple[EarlierCalibration, ...]:
    with database.read() as session:
        return earlier_calibrations(session, stage)


def test_stages_of_the_same_calibration_have_a_check_and_others_a_rig(database: Database) -> None:
    surgery, calibration = new_surgery(database), new_calibration(database)
    measure(database, new_stage(database, surgery, calibration=calibration), 12)
    new_stage(database, surgery, "INTER", calibration=calibration)
    new_stage(database, surgery, "OTHER")
    stage = new_stage(database, surgery, "POST", calibration=calibration)
    new_stage(database, surgery, "AFTER", calibration=calibration)
    before, inter, other = found(database, stage)
    assert before.rig_check is not None
    assert (before.name, before.other_rig, before.rig_check["balls"]) == ("PRE", None, 12)
    assert inter == EarlierCalibration("INTER")
    assert other.other_rig is not None
    assert (other.name, other.rig_check) == ("OTHER", None)


def test_a_take_that_was_replaced_or_failed_counts_no_more(database: Database) -> None:
    surgery, calibration = new_surgery(database), new_calibration(database)
    measure(database, new_stage(database, surgery), 12)
    with database.write() as session:
        again = stage_submission.submit(
            session,
            surgeries.get(session, surgery),
            calibrations.get(session, calibration),
            NewStage("PRE", image(b"l"), image(b"r"), None),
            at(1),
            CLIENT,
            retake=True,
        )
    end(database, new_stage(database, surgery, "FAILED").job.id, JobState.FAILED)
    end(database, new_stage(database, surgery, "CANCELLED").job.id, JobState.CANCELLED)
    stage = new_stage(database, surgery, "POST", calibration=calibration)
    assert found(database, stage) == (EarlierCalibration("PRE"),)
    measure(database, again, 9)
    (before,) = found(database, stage)
    assert before.rig_check is not None
    assert before.rig_check["balls"] == 9


def test_a_stage_that_was_measured_again_has_the_check_of_the_last_measurement(database: Database) -> None:
    surgery, calibration = new_surgery(database), new_calibration(database)
    measure(database, new_stage(database, surgery, calibration=calibration), 12)
    with database.write() as session:
        changes = Remeasurement(kind="measure", take=1)
        revised = stage_submission.revise(session, surgery, "PRE", changes, at(1), CLIENT)
    measure(database, revised, 9)
    (before,) = found(database, new_stage(database, surgery, "POST", calibration=calibration))
    assert before.rig_check is not None
    assert before.rig_check["balls"] == 9
