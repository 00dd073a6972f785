import httpx
import pytest

from commands.shared.api_client import ApiClient, ServiceError, SubmittedStage
from commands.shared.job_progress import wait_for_jobs

STAGES = [SubmittedStage("PRE", "/v1/jobs/pre"), SubmittedStage("POST", "/v1/jobs/post")]


def client(states: dict[str, list[str]]) -> ApiClient:
    """Return a client whose jobs go through the given states, one per poll, and stay in the last."""

    def handle(request: httpx.Request) -> httpx.Response:
        left = states[request.url.path]
        state = left.pop(0) if len(left) > 1 else left[0]
        return httpx.Response(200, json={"state": state, "progress": 0.5, "step": None})

    return ApiClient("http://service", httpx.MockTransport(handle))


def test_all_jobs_are_followed_to_their_end(capsys: pytest.CaptureFixture[str]) -> None:
    states = {"/v1/jobs/pre": ["queued", "running", "succeeded"], "/v1/jobs/post": ["failed"]}
    with client(states) as api:
        jobs = wait_for_jobs(api, STAGES)
    assert {name: job["state"] for name, job in jobs.items()} == {"PRE": "succeeded", "POST": "failed"}
    assert capsys.readouterr().out.splitlines() == ["POST: failed", "PRE: succeeded"]


def test_a_job_that_does_not_end_is_named() -> None:
    states = {"/v1/jobs/pre": ["succeeded"], "/v1/jobs/post": ["running"]}
    with client(states) as api, pytest.raises(ServiceError, match=r"^POST not measured after 0 s"):
        wait_for_jobs(api, STAGES, timeout_seconds=0.2)
