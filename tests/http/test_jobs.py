"""Jobs over HTTP; the service has no worker here, so that jobs stay where they are."""

from tests.http.harness import Service, code_of, pair


def test_a_job_waits_without_workers_and_can_be_cancelled_once(idle: Service) -> None:
    surgery, calibration = idle.surgery(), idle.calibration()
    job = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    assert idle.job(job)["state"] == "queued"
    for part in ("triads", "features"):
        answer = idle.client.get(f"/v1/surgeries/{surgery}/stages/PRE/{part}")
        assert code_of(answer, 409) == "stage-not-measured"
    motion = idle.client.get(f"/v1/surgeries/{surgery}/motion", params={"from": "PRE", "to": "POST"})
    assert code_of(motion, 409) == "stage-not-measured"

    cancelled = idle.client.post(f"/v1/jobs/{job}/cancel")
    assert cancelled.status_code == 200
    assert cancelled.json()["state"] == "cancelled"
    assert cancelled.json()["finished_at"] is not None
    assert code_of(idle.client.post(f"/v1/jobs/{job}/cancel"), 409) == "job-finished"


def test_a_cancelled_stage_is_not_measured_and_may_be_taken_again(idle: Service) -> None:
    surgery, calibration = idle.surgery(), idle.calibration()
    first = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    assert code_of(idle.send(surgery, "PRE", pair("POST"), calibration), 409) == "stage-exists"
    idle.client.post(f"/v1/jobs/{first}/cancel")
    second = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    idle.start("worker")
    assert idle.finished(second)["state"] == "succeeded"
    assert idle.job(first)["state"] == "cancelled"
    assert idle.job(first)["attempts"] == 0
    assert code_of(idle.client.post(f"/v1/jobs/{second}/cancel"), 409) == "job-finished"
    idle.kill_workers()


def test_a_job_of_a_deleted_surgery_answers_as_the_surgery_does(idle: Service) -> None:
    surgery = idle.surgery()
    job = idle.submit(surgery, "PRE", pair("PRE"), idle.calibration())
    assert idle.client.delete(f"/v1/surgeries/{surgery}").status_code == 204
    assert code_of(idle.client.get(f"/v1/surgeries/{surgery}"), 410) == "surgery-deleted"
    assert code_of(idle.client.get(f"/v1/jobs/{job}"), 410) == "surgery-deleted"
    assert code_of(idle.client.post(f"/v1/jobs/{job}/cancel"), 410) == "surgery-deleted"


def test_an_unknown_job(idle: Service) -> None:
    assert code_of(idle.client.get("/v1/jobs/none"), 404) == "job-not-found"
    assert code_of(idle.client.post("/v1/jobs/none/cancel"), 404) == "job-not-found"
