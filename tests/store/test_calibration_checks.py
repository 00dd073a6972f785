from store import calibration_checks
from store.calibration_checks import DRIFTED, OLD
from store.database import Database
from store.page import PageRequest
from tests.store.builders import RIG_CHECK, claimed, new_stage, new_surgery, stage_result, succeed


def flagged(*codes: str) -> list[dict[str, str]]:
    return [{"code": code, "detail": "A remark."} for code in codes]


def test_the_stages_measured_with_a_calibration_are_counted_by_their_flags(database: Database) -> None:
    surgery = new_surgery(database)
    first = new_stage(database, surgery, "S0")
    calibration = first.calibration_id
    others = [new_stage(database, surgery, f"S{n}", calibration=calibration) for n in (1, 2, 3)]
    new_stage(database, surgery, "waiting", calibration=calibration)
    new_stage(database, surgery, "other")
    for stage, codes in zip((first, *others), ((), (OLD,), (DRIFTED, OLD), ("a-flag",)), strict=True):
        result = stage_result(flags=flagged(*codes), rig_check=RIG_CHECK)
        assert succeed(database, claimed(database, stage.job.id), result=result)
    with database.read() as session:
        summary = calibration_checks.summary(session, calibration)
        page = calibration_checks.listed(session, calibration, PageRequest(10, "created_at"))
        scales = calibration_checks.marker_scales(session, calibration)
        assert calibration_checks.summary(session, "none").stages == 0
        assert calibration_checks.marker_scales(session, "none") == []
    assert [scale.model_dump() for scale in scales] == [RIG_CHECK["marker_scale"]] * 4
    assert (summary.stages, summary.drifted, summary.old) == (4, 1, 2)
    assert {stage.name for stage in page.items} == {"S0", "S1", "S2", "S3"}
    assert page.items[0].measurement is not None
    assert page.items[0].measurement.result["rig_check"] == RIG_CHECK


def test_stages_without_a_check_have_no_scale(database: Database) -> None:
    stage = new_stage(database, new_surgery(database), "S0")
    assert succeed(database, claimed(database, stage.job.id), result=stage_result())
    with database.read() as session:
        assert calibration_checks.marker_scales(session, stage.calibration_id) == []
