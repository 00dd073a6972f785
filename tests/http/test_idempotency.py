"""A request that is sent again, because its answer was lost, is carried out once."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any
from uuid import uuid4

import httpx
import pytest

from contract.key import Scope
from tests.http.harness import RIG, Service, board, code_of, pair, problem_of

SURGERY = {"reference": "2026-0417", "vertebrae": ["L1", "T11"], "reference_vertebra": "L1"}


def key() -> dict[str, str]:
    return {"Idempotency-Key": f'"{uuid4()}"'}


def stage(
    service: Service,
    surgery: str,
    name: str,
    images: Any,
    calibration: str,
    headers: dict[str, str],
    **fields: str,
) -> httpx.Response:
    files = {"left": ("left", images[0]), "right": ("right", images[1])}
    data = {"name": name, "calibration_id": calibration, **fields}
    return service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files, headers=headers)


def assert_replayed(first: httpx.Response, again: httpx.Response) -> None:
    assert (again.status_code, again.text) == (first.status_code, first.text)
    assert again.headers["location"] == first.headers["location"]
    assert again.headers["idempotency-replayed"] == "true"
    assert "idempotency-replayed" not in first.headers


def test_a_surgery_is_stored_once(idle: Service) -> None:
    headers = key()
    first, again = (idle.client.post("/v1/surgeries", json=SURGERY, headers=headers) for _ in range(2))
    assert_replayed(first, again)
    other = idle.client.post("/v1/surgeries", json=SURGERY, headers=key())
    assert other.json()["id"] != first.json()["id"]


def test_two_keys_of_one_request_are_refused(idle: Service) -> None:
    before = idle.client.get("/v1/surgeries").json()["total"]
    headers = [*idle.client.headers.items(), ("Idempotency-Key", "aa1"), ("Idempotency-Key", "bb1")]
    assert code_of(idle.client.post("/v1/surgeries", json=SURGERY, headers=headers), 400) == "bad-request"
    assert idle.client.get("/v1/surgeries").json()["total"] == before


def test_a_calibration_is_stored_once(idle: Service) -> None:
    headers = key()
    first, again = (idle.client.post("/v1/calibrations", json=RIG, headers=headers) for _ in range(2))
    assert_replayed(first, again)


def assert_runs(first: httpx.Response, again: httpx.Response) -> None:
    """Check that a repeated request names the job that has not ended."""
    assert code_of(again, 409) == "job-not-ended"
    assert again.headers["location"] == first.headers["location"]
    assert "idempotency-replayed" not in again.headers


def test_a_stage_is_stored_once_whatever_divides_its_parts(idle: Service) -> None:
    surgery, calibration, headers = idle.surgery(), idle.calibration(), key()
    first, again = (stage(idle, surgery, "PRE", pair("PRE"), calibration, headers) for _ in range(2))
    assert first.request.headers["content-type"] != again.request.headers["content-type"]
    assert first.status_code == 202
    assert_runs(first, again)
    idle.client.post(f"{first.headers['location']}/cancel")
    assert_replayed(first, stage(idle, surgery, "PRE", pair("PRE"), calibration, headers))
    assert len(idle.client.get(f"/v1/surgeries/{surgery}").json()["stages"]) == 1


def test_shots_are_stored_once(idle: Service) -> None:
    headers, images = key(), board("A")
    data = {"name": "cart 1", "control_field": "pegboard-1995"}
    files = {"left": ("left", images[0]), "right": ("right", images[1])}
    first, again = (
        idle.client.post("/v1/calibrations/from-images", data=data, files=files, headers=headers)
        for _ in range(2)
    )
    assert first.status_code == 202, first.text
    assert_runs(first, again)


def test_a_job_is_cancelled_once(idle: Service) -> None:
    job = idle.submit(idle.surgery(), "PRE", pair("PRE"), idle.calibration())
    headers = key()
    first, again = (idle.client.post(f"/v1/jobs/{job}/cancel", headers=headers) for _ in range(2))
    assert (first.status_code, again.status_code) == (200, 200)
    assert first.text == again.text
    assert code_of(idle.client.post(f"/v1/jobs/{job}/cancel", headers=key()), 409) == "job-finished"


def test_another_request_with_the_same_key_is_refused(idle: Service) -> None:
    headers = key()
    assert idle.client.post("/v1/surgeries", json=SURGERY, headers=headers).status_code == 201
    other = idle.client.post("/v1/surgeries", json={**SURGERY, "reference": "case 2"}, headers=headers)
    assert code_of(other, 422) == "idempotency-key-reused"
    elsewhere = idle.client.post("/v1/calibrations", json=RIG, headers=headers)
    assert code_of(elsewhere, 422) == "idempotency-key-reused"


def test_another_image_with_the_same_key_is_refused(idle: Service) -> None:
    surgery, calibration, headers = idle.surgery(), idle.calibration(), key()
    assert stage(idle, surgery, "PRE", pair("PRE"), calibration, headers).status_code == 202
    other = stage(idle, surgery, "PRE", pair("POST"), calibration, headers)
    assert code_of(other, 422) == "idempotency-key-reused"


def test_a_refused_request_may_be_corrected_with_its_key(idle: Service) -> None:
    headers = key()
    wrong = idle.client.post("/v1/surgeries", json={**SURGERY, "reference_vertebra": "T1"}, headers=headers)
    assert wrong.status_code == 422
    assert idle.client.post("/v1/surgeries", json=SURGERY, headers=headers).status_code == 201


def test_the_same_key_of_another_client_is_another_key(idle: Service) -> None:
    headers = key()
    first = idle.client.post("/v1/surgeries", json=SURGERY, headers=headers)
    other_key = idle.make_key(Scope.CAPTURE_WRITE)
    other = idle.client.post(
        "/v1/surgeries", json=SURGERY, headers={**headers, "Authorization": f"Bearer {other_key}"}
    )
    assert other.status_code == 201
    assert other.json()["id"] != first.json()["id"]


def test_requests_at_the_same_time_are_carried_out_once(idle: Service) -> None:
    surgery, calibration, headers = idle.surgery(), idle.calibration(), key()
    with ThreadPoolExecutor(8) as pool:
        calls = [
            pool.submit(stage, idle, surgery, "PRE", pair("PRE"), calibration, headers) for _ in range(8)
        ]
        answers = [call.result() for call in calls]
    assert sorted(answer.status_code for answer in answers) == [202, *[409] * 7]
    assert len({answer.headers["location"] for answer in answers}) == 1


def test_a_request_is_replayed_once_its_job_has_ended(
    service: Service, surgery: str, calibration: str
) -> None:
    headers = key()
    first = stage(service, surgery, "PRE", pair("PRE"), calibration, headers)
    service.finished(first.headers["location"].removeprefix("/v1/jobs/"))
    assert_replayed(first, stage(service, surgery, "PRE", pair("PRE"), calibration, headers))


def test_answers_with_a_secret_take_no_key(idle: Service) -> None:
    before = idle.client.get("/v1/keys").json()["total"]
    new = {"name": "cart", "scopes": ["capture:write"]}
    for answer in (
        idle.client.post("/v1/keys", json=new, headers=key()),
        idle.client.post("/v1/session", headers=key()),
    ):
        assert code_of(answer, 422) == "idempotency-key-refused"
        assert "Set-Cookie" not in answer.headers
    assert idle.client.get("/v1/keys").json()["total"] == before


def test_every_post_takes_a_key_or_says_why_not(idle: Service) -> None:
    paths = idle.client.get("/openapi.json").json()["paths"]
    for path, methods in paths.items():
        if "post" not in methods:
            continue
        takes = any(entry["name"] == "Idempotency-Key" for entry in methods["post"].get("parameters", []))
        assert takes or "Idempotency-Key" in methods["post"]["description"], path


@pytest.mark.parametrize("value", [b"", b'""', b"a b", b'"a', b"x" * 201, "\u00e4".encode()])
def test_a_key_that_is_none_is_refused(idle: Service, value: bytes) -> None:
    answer = idle.client.post("/v1/surgeries", json=SURGERY, headers={b"Idempotency-Key": value})
    assert code_of(answer, 422) == "invalid-request"


def test_the_same_pair_again_is_answered_with_the_stage_that_is_there(idle: Service) -> None:
    surgery, calibration = idle.surgery(), idle.calibration()
    first = idle.send(surgery, "PRE", pair("PRE"), calibration)
    again = idle.send(surgery, "PRE", pair("PRE"), calibration)
    assert again.status_code == 200
    assert again.json()["id"] == first.json()["id"]
    shown = idle.client.get(again.headers["location"])
    assert shown.json()["id"] == first.json()["id"]


def test_another_pair_under_a_name_in_use_is_refused_with_the_job(idle: Service) -> None:
    surgery, calibration = idle.surgery(), idle.calibration()
    job = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    other = idle.send(surgery, "PRE", pair("POST"), calibration)
    assert code_of(other, 409) == "stage-exists"
    assert other.headers["location"] == f"/v1/jobs/{job}"
    assert "queued" in problem_of(other, 409)["detail"]
    cameras = idle.send(surgery, "PRE", pair("PRE"), idle.calibration())
    assert code_of(cameras, 409) == "stage-exists"
