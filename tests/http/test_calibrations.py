"""Calibrations from shots of a control field, from the upload to the stages measured with them."""

import hashlib
import io
import json
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from service.forms.options import INTERIOR
from spinewatch.calibration.control_field import ControlField, pegboard_1995
from spinewatch.calibration.point_tables import control_field_csv
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, PARAMETER_NAMES
from tests.backends import INTEGRITY_ERRORS, fault
from tests.http.harness import FINAL, RIG, Pair, Service, board, code_of, pair, problem_of, wait_for
from tests.http.test_stages import encoded, png_header

FROM_IMAGES = "/v1/calibrations/from-images"
STORED = """
    SELECT (SELECT count(*) FROM calibration_requests), (SELECT count(*) FROM calibration_shots),
           (SELECT count(*) FROM jobs), (SELECT count(*) FROM images), (SELECT count(*) FROM events)
"""


def show(service: Service, job: dict[str, Any]) -> dict[str, Any]:
    assert job["state"] == "succeeded", job
    answer = service.client.get(f"/v1/calibrations/{job['calibration_id']}")
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


@pytest.fixture(scope="module")
def made(service: Service) -> dict[str, Any]:
    """A calibration from one shot, verified by another."""
    job = service.calibrated(board("C"), board("A"), verify="1", captured_at="2026-11-21T10:30:00+01:00")
    return show(service, job)


def test_the_job_tells_how_far_it_is_and_then_the_calibration(service: Service) -> None:
    answer = service.shoot(board("C"), board("A"), board("B"), verify="2")
    assert answer.status_code == 202
    job = answer.json()
    assert answer.headers["Location"] == f"/v1/jobs/{job['id']}"
    assert (job["kind"], job["calibration_id"], job["surgery_id"]) == ("calibration", None, None)
    seen = []
    while job["state"] not in FINAL:
        job = service.job(job["id"])
        seen.append((job["progress"], job["step"]))
    assert [fraction for fraction, _ in seen] == sorted(fraction for fraction, _ in seen)
    steps = {step for _, step in seen}
    assert steps & {*(f"find targets of shot {n} of 3" for n in (1, 2, 3)), "decode", "adjust", "assess"}, (
        steps
    )
    assert job["calibration_id"] is not None
    assert service.client.get(f"/v1/calibrations/{job['calibration_id']}").status_code == 200


def test_a_calibration_shows_what_it_was_made_from_and_how_good_it_is(
    service: Service, made: dict[str, Any]
) -> None:
    assert made["name"] == made["rig"]["name"] == "cart 1"
    assert made["calibrated_at"] == "2026-11-21T09:30:00Z"
    assert made["checks"] == {"stages": 0, "drifted": 0, "old": 0}
    report = made["report"]
    assert report["control_field"] == {"name": "pegboard-1995", "points": 30}
    assert report["geometry"]["baseline_mm"] == pytest.approx(421.9, abs=1.5)
    assert report["geometry"]["vergence_deg"] == pytest.approx(32.2, abs=0.3)
    assert 0 < report["geometry"]["baseline_sd_mm"] < 1
    used, fresh = report["shots"]
    assert (used["used"], fresh["used"]) == (True, False)
    assert np.all(np.array(fresh["sd_mm"]) < (0.04, 0.05, 0.10))
    assert made["brief"] == {
        "leave_one_out_sd_mm": report["leave_one_out"]["sd_mm"],
        "flags": report["flags"],
    }
    assert report["limits"]["reference_sd_mm"] == [0.34, 0.35, 0.66]
    assert "residual_px" in used["points"]["left"][0]
    assert fresh["points"]["left"][0]["residual_px"] is None
    assert set(report["cameras"]["left"]["free"]) == set(report["cameras"]["left"]["sd"])
    assert report["removed"] == []
    for number, (shot, trial) in enumerate(zip((used, fresh), ("C", "A"), strict=True), start=1):
        for side, content in zip(("left", "right"), board(trial), strict=True):
            assert shot["images"][side]["sha256"] == hashlib.sha256(content).hexdigest()
            url = f"/v1/calibrations/{made['id']}/shots/{number}/images/{side}"
            got = service.client.get(url)
            assert (got.content, got.headers["content-type"]) == (content, "image/png")
            again = service.client.get(url, headers={"If-None-Match": got.headers["etag"]})
            assert again.status_code == 304


def test_a_repeated_shot_is_left_out_and_the_others_keep_their_images(service: Service) -> None:
    again = [encoded(np.asarray(Image.open(io.BytesIO(content))), "TIFF") for content in board("C")]
    job = service.calibrated(board("C"), (again[0], again[1]), board("A"), verify="1")
    report = show(service, job)["report"]
    assert [shot["number"] for shot in report["shots"]] == [1, 3]
    assert [flag["code"] for flag in report["flags"]] == ["shot-repeated"]
    assert report["shots"][1]["images"]["left"]["sha256"] == hashlib.sha256(board("A")[0]).hexdigest()
    answer = service.client.get(f"/v1/calibrations/{job['calibration_id']}/shots/3/images/left")
    assert answer.headers["etag"] == f'"{report["shots"][1]["images"]["left"]["sha256"]}"'


def test_the_list_has_rigs_only(service: Service, made: dict[str, Any]) -> None:
    given = service.calibration()
    items = service.client.get("/v1/calibrations", params={"limit": 200}).json()["items"]
    by_id = {item["id"]: item for item in items}
    assert by_id[made["id"]]["has_report"] is True
    assert by_id[given]["has_report"] is False
    assert by_id[made["id"]]["brief"] == made["brief"]
    assert by_id[given]["brief"] is None
    assert "report" not in by_id[made["id"]]


def test_the_report_is_a_page_that_needs_nothing_else(service: Service, made: dict[str, Any]) -> None:
    page = service.client.get(f"/v1/calibrations/{made['id']}/report")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert "Calibration of cart 1" in page.text
    assert "http" not in page.text
    assert "&amp;" not in page.text
    assert "<script" not in page.text
    assert "default-src 'none'" in page.headers["content-security-policy"]


def test_a_name_is_escaped_in_the_report(service: Service) -> None:
    shown = show(service, service.calibrated(board("C"), name="<script>alert(1)</script>"))
    page = service.client.get(f"/v1/calibrations/{shown['id']}/report").text
    assert "<script" not in page
    assert "&lt;script" in page


def test_what_a_given_rig_has_not(service: Service, made: dict[str, Any]) -> None:
    given = service.calibration()
    for part in ("report", "shots/1/images/left"):
        answer = service.client.get(f"/v1/calibrations/{given}/{part}")
        assert code_of(answer, 404) == "report-not-found"
    assert code_of(service.client.get(f"/v1/calibrations/{made['id']}/shots/3/images/left"), 404) == (
        "shot-not-found"
    )
    for part in ("report", "checks", "shots/1/images/left"):
        assert code_of(service.client.get(f"/v1/calibrations/none/{part}"), 404) == "calibration-not-found"


def test_a_stage_is_measured_with_it(service: Service, surgery: str, made: dict[str, Any]) -> None:
    job = service.submit(surgery, "PRE", pair("PRE"), made["id"])
    assert service.finished(job)["state"] == "succeeded"
    triads = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/triads").json()
    assert triads["frame"] == "object space of calibration cart 1"
    assert len(triads["triads"]) == 4


CSV = control_field_csv(pegboard_1995())


@pytest.mark.parametrize(
    "field", [CSV, CSV.encode(), CSV.replace("\n", "\r").encode(), b"\xef\xbb\xbf" + CSV.encode()]
)
def test_a_control_field_comes_as_text_or_file(
    service: Service, made: dict[str, Any], field: str | bytes
) -> None:
    shown = show(service, service.calibrated(board("C"), board("A"), field=field, verify="1"))
    assert shown["rig"] == made["rig"]
    name = "board.csv" if isinstance(field, bytes) else "control field"
    assert shown["report"]["control_field"] == {"name": name, "points": 30}


def test_options_reach_the_solver(service: Service, made: dict[str, Any]) -> None:
    shown = show(
        service, service.calibrated(board("C"), free="f,K1", fix="x0=0.01", pixel_size="0.010,0.00845")
    )
    interior = [
        name for name in shown["report"]["cameras"]["left"]["free"] if name in {"f", "x0", "y0", "K1"}
    ]
    assert interior == ["f", "K1"]
    assert shown["rig"]["left"]["principal_point_mm"][0] == 0.01
    codes = {flag["code"] for flag in shown["report"]["flags"]}
    assert codes == {"parameters-held", "held-value-contradicted"}  # that of the left camera is 0.061 mm
    aspect = show(service, service.calibrated(board("C"), board("A"), estimate_aspect="true"))
    assert "aspect" in aspect["report"]["cameras"]["left"]["free"]
    assert "aspect" not in made["report"]["cameras"]["left"]["free"]


def test_the_interior_parameters_are_those_of_the_library() -> None:
    assert (*EXTERIOR_NAMES, *INTERIOR, "aspect") == PARAMETER_NAMES


def test_empty_options_are_none(service: Service, made: dict[str, Any]) -> None:
    empty = dict.fromkeys(("free", "fix", "pixel_size", "captured_at"), "")
    shown = show(service, service.calibrated(board("C"), board("A"), verify="1", **empty))
    assert shown["rig"] == made["rig"]


def swapped(images: Pair) -> Pair:
    return images[1], images[0]


FLAT = control_field_csv(ControlField("flat", pegboard_1995().ids, pegboard_1995().points_mm * (1, 1, 0)))
BLANK = encoded(np.full((416, 568), 90, np.uint8), "PNG")


@pytest.mark.parametrize(
    ("shots", "field", "code", "words"),
    [
        ([swapped(board("C"))], "pegboard-1995", "left-right-swapped", "exchange left and right"),
        ([board("C"), (board("A")[0], BLANK)], "pegboard-1995", "targets-not-found", "shot 2"),
        ([board("C")], FLAT, "planar-field", "heights"),
        ([board("C")], "pegboard-2095", "invalid-control-field", "choose from pegboard-1995"),
        ([board("C")], "id,x_mm,y_mm\n1,2,3\n", "invalid-control-field", "z_mm"),
        (
            [(board("C")[0][:20_000], board("C")[1])],
            "pegboard-1995",
            "invalid-image",
            "left image of shot 1",
        ),
    ],
)
def test_shots_that_cannot_be_used_fail_the_job_by_name(
    service: Service, shots: list[Pair], field: str, code: str, words: str
) -> None:
    count = "SELECT count(*) FROM calibrations"
    before = service.sql(count)
    job = service.calibrated(*shots, field=field)
    assert (job["state"], job["attempts"], job["calibration_id"]) == ("failed", 1, None)
    assert job["error"]["type"] == f"urn:spinewatch:problem:{code}"
    assert words in job["error"]["detail"]
    assert service.sql(count) == before


def other_sized() -> bytes:
    return encoded(np.zeros((416, 600), np.uint8), "PNG")


HUGE = png_header(8000, 7000)  # one of them is not too large yet
REFUSED: list[tuple[list[Pair], dict[str, Any], str, list[str | int]]] = [
    ([board("C")], {"verify": "1"}, "invalid-request", ["body"]),
    ([board("C")], {"verify": "-1"}, "invalid-request", ["body", "verify"]),
    ([board("C")], {"verify": "some"}, "invalid-request", ["body", "verify"]),
    ([board("C")], {"name": ""}, "invalid-request", ["body", "name"]),
    ([board("C")], {"pixel_size": "0.01"}, "invalid-request", ["body", "pixel_size"]),
    ([board("C")], {"pixel_size": "0,0.01"}, "invalid-request", ["body", "pixel_size"]),
    ([board("C")], {"free": "f,zoom"}, "invalid-request", ["body", "free"]),
    ([board("C")], {"free": "f,f"}, "invalid-request", ["body", "free"]),
    ([board("C")], {"fix": "x0"}, "invalid-request", ["body", "fix"]),
    ([board("C")], {"fix": "x0=1,x0=2"}, "invalid-request", ["body", "fix"]),
    ([board("C")], {"captured_at": "today"}, "invalid-request", ["body", "captured_at"]),
    ([board("C")], {"patient": "x"}, "invalid-request", ["body", "patient"]),
    ([board("C")], {"field": b"\xff\xfe"}, "invalid-control-field", ["body", "control_field"]),
    ([board("C")], {"field": CSV.encode() + b"\0"}, "invalid-control-field", ["body", "control_field"]),
    ([board("C")], {"field": b" " * 70_000}, "invalid-control-field", ["body", "control_field"]),
    ([board("C")] * 21, {}, "invalid-request", ["body", "left"]),
    ([board("C"), board("C")], {"verify": "1"}, "same-image-twice", ["body", "left", 1]),
    ([(board("C")[0], board("C")[0])], {}, "same-image-twice", ["body", "right", 0]),
    ([board("C"), (board("A")[0], b"GIF89a")], {}, "invalid-image", ["body", "right", 1]),
    ([board("C"), (board("A")[0], other_sized())], {}, "image-size-mismatch", ["body", "right", 1]),
    ([(HUGE + b"1", HUGE + b"2"), (HUGE + b"3", HUGE + b"4")], {}, "invalid-image", ["body", "left"]),
]


@pytest.mark.parametrize(("shots", "fields", "code", "loc"), REFUSED)
def test_what_can_be_told_from_headers_is_refused_at_once(
    service: Service, shots: list[Pair], fields: dict[str, Any], code: str, loc: list[str | int]
) -> None:
    before = service.sql(STORED)
    problem = problem_of(service.shoot(*shots, **fields), 422)
    assert problem["type"] == f"urn:spinewatch:problem:{code}"
    assert problem["errors"][0]["loc"][: len(loc)] == loc
    assert service.sql(STORED) == before


def test_both_sides_of_every_shot_are_asked_for(service: Service) -> None:
    left, right = board("C")
    files = [("left", left), ("left", board("A")[0]), ("right", right)]
    answer = service.client.post(
        FROM_IMAGES, data={"name": "x", "control_field": "pegboard-1995"}, files=files
    )
    assert "2 left and 1 right" in problem_of(answer, 422)["errors"][0]["msg"]
    answer = service.client.post(FROM_IMAGES, data={"name": "x"}, files={"left": left})
    assert [error["loc"][-1] for error in problem_of(answer, 422)["errors"]] == ["control_field", "right"]
    assert code_of(service.client.post(FROM_IMAGES, json={}), 415) == "unsupported-media-type"


@pytest.mark.parametrize("table", ["calibration_requests", "calibration_shots", "images", "jobs", "events"])
def test_an_upload_is_stored_as_a_whole_or_not_at_all(idle: Service, table: str) -> None:
    before = idle.sql(STORED)
    new: Pair = (encoded(np.full((9, 9), 1, np.uint8), "PNG"), encoded(np.full((9, 9), 2, np.uint8), "PNG"))
    with fault(idle.database_url, table):
        assert code_of(idle.shoot(new), 500) == "internal-error"
    assert idle.sql(STORED) == before


@pytest.mark.parametrize("table", ["calibrations", "calibration_reports", "events"])
def test_a_result_that_cannot_be_written_is_written_by_a_later_attempt(idle: Service, table: str) -> None:
    job = idle.shoot(board("C")).json()["id"]
    only = "NEW.action = 'calibration:solved'" if table == "events" else ""
    with fault(idle.database_url, table, only):
        idle.start("worker", SPINEWATCH_LEASE_SECONDS="1", SPINEWATCH_MAX_ATTEMPTS="100")
        wait_for(lambda: idle.job(job)["attempts"] >= 2, "a second attempt")
    done = idle.finished(job)
    idle.kill_workers()
    assert done["state"] == "succeeded"
    assert idle.sql("SELECT count(*) FROM calibrations WHERE id = ?", done["calibration_id"]) == [(1,)]
    assert idle.events(done["calibration_id"]).count("worker:calibration:solved") == 1


def test_a_calibration_can_be_cancelled_like_a_stage(idle: Service) -> None:
    job = idle.shoot(board("C")).json()["id"]
    cancelled = idle.client.post(f"/v1/jobs/{job}/cancel").json()
    assert (cancelled["state"], cancelled["kind"]) == ("cancelled", "calibration")
    assert code_of(idle.client.post(f"/v1/jobs/{job}/cancel"), 409) == "job-finished"


def test_a_calibration_in_use_cannot_be_changed_or_deleted(
    service: Service, surgery: str, made: dict[str, Any]
) -> None:
    service.finished(service.submit(surgery, "PRE", pair("PRE"), made["id"]))
    url = f"/v1/calibrations/{made['id']}"
    shown = service.client.get(url).json()
    for method in ("PUT", "PATCH", "DELETE", "POST"):
        answer = service.client.request(method, url, json=RIG)
        assert code_of(answer, 405) == "method-not-allowed"
    for statement in (
        "UPDATE calibrations SET rig = '{}' WHERE id = ?",
        "DELETE FROM calibrations WHERE id = ?",
        "UPDATE calibration_reports SET report = '{}' WHERE calibration_id = ?",
        "DELETE FROM calibration_reports WHERE calibration_id = ?",
    ):  # directly in the database, where SQLite does not check foreign keys
        with pytest.raises(INTEGRITY_ERRORS, match="never change"):
            service.sql(statement, made["id"])
    assert service.client.get(url).json() == shown


def given(service: Service, rig: dict[str, Any] = RIG, **query: str) -> str:
    answer = service.client.post("/v1/calibrations", json=rig, params=query)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def flags_of(service: Service, surgery: str, name: str) -> list[str]:
    stage = service.client.get(f"/v1/surgeries/{surgery}/stages/{name}").json()
    return [flag["code"] for flag in stage["flags"]]


def checks(service: Service, calibration: str) -> list[dict[str, Any]]:
    answer: httpx.Response = service.client.get(f"/v1/calibrations/{calibration}/checks")
    assert answer.status_code == 200, answer.text
    items: list[dict[str, Any]] = answer.json()["items"]
    return items


def test_a_time_without_a_zone_is_no_time_of_calibration(service: Service) -> None:
    answer = service.client.post(
        "/v1/calibrations", json=RIG, params={"calibrated_at": "2026-11-21T09:30:00"}
    )
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["query", "calibrated_at"]


@pytest.mark.parametrize("calibrated_at", ["1970-01-01T00:00:00Z", "2099-01-01T00:00:00Z"])
def test_an_implausible_time_of_calibration_is_refused(service: Service, calibrated_at: str) -> None:
    answer = service.client.post("/v1/calibrations", json=RIG, params={"calibrated_at": calibrated_at})
    assert code_of(answer, 422) == "time-implausible"
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["query", "calibrated_at"]
    assert code_of(service.shoot(board("C"), captured_at=calibrated_at), 422) == "time-implausible"


def test_an_old_calibration_is_flagged_and_its_checks_tell_the_age(service: Service, surgery: str) -> None:
    calibration = given(service, calibrated_at="2026-11-19T08:00:00+01:00")
    assert (
        service.client.get(f"/v1/calibrations/{calibration}").json()["calibrated_at"]
        == "2026-11-19T07:00:00Z"
    )
    for name, captured_at in (
        ("before", "2026-11-18T07:00:00Z"),
        ("young", "2026-11-20T06:59:59Z"),
        ("old", "2026-11-20T19:00:00Z"),
    ):
        sent = service.send(surgery, name, pair("PRE"), calibration, captured_at)
        service.finished(sent.json()["job"]["id"])
    assert ["calibration-old" in flags_of(service, surgery, n) for n in ("before", "young", "old")] == [
        False,
        False,
        True,
    ]
    found = checks(service, calibration)[::-1]  # the newest comes first
    assert [(item["stage"], round(item["age_days"], 3)) for item in found] == [
        ("before", -1.0),
        ("young", 1.0),
        ("old", 1.5),
    ]
    assert [[flag["code"] for flag in item["flags"]] for item in found] == [[], [], ["calibration-old"]]
    assert "1.5 days old" in found[2]["flags"][0]["detail"]
    shown = service.client.get(f"/v1/calibrations/{calibration}").json()
    assert shown["checks"] == {"stages": 3, "drifted": 0, "old": 1}
    triads = service.client.get(f"/v1/surgeries/{surgery}/stages/old/triads").json()
    assert triads["parameters"]["calibration_max_age_days"] == 1.0


def test_how_old_is_too_old_can_be_set(idle: Service) -> None:
    calibration, surgery = given(idle, calibrated_at="2026-11-19T07:00:00Z"), idle.surgery()
    idle.start("worker", SPINEWATCH_CALIBRATION_MAX_AGE_DAYS="2")
    for name, captured_at in (("young", "2026-11-21T06:00:00Z"), ("old", "2026-11-21T08:00:00Z")):
        sent = idle.send(surgery, name, pair("PRE"), calibration, captured_at)
        idle.finished(sent.json()["job"]["id"])
    idle.kill_workers()
    assert "calibration-old" not in flags_of(idle, surgery, "young")
    assert "calibration-old" in flags_of(idle, surgery, "old")


def test_a_bumped_camera_shows_in_the_checks(service: Service, surgery: str) -> None:
    bumped = json.loads(json.dumps(RIG))
    bumped["right"]["rotation_deg"][0] += 0.05
    sound, moved = given(service), given(service, bumped)
    for calibration, name in ((sound, "PRE"), (moved, "POST")):
        service.finished(service.submit(surgery, name, pair(name), calibration))
    (good,), (bad,) = checks(service, sound), checks(service, moved)
    assert (good["drift"]["drifted"], good["flags"]) == (False, [])
    assert bad["drift"]["drifted"] is True
    assert [flag["code"] for flag in bad["flags"]] == ["calibration-drift"]
    rotation, sd = bad["drift"]["rotation_deg"][0], bad["drift"]["rotation_sd_deg"][0]
    assert abs(rotation - 0.05) < 2 * sd
    assert bad["drift"]["rms_px"] > 3 * good["drift"]["rms_px"]
    assert service.client.get(f"/v1/calibrations/{moved}").json()["checks"]["drifted"] == 1
    pooled = service.client.get(f"/v1/calibrations/{sound}/checks").json()["pooled_scale"]
    assert pooled["drifted"] is False
    assert abs(pooled["scale"] - good["drift"]["marker_scale"]["scale"]) < 1e-12  # of one stage
