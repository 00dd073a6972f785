from datetime import UTC, datetime
from typing import Any

import pytest
from pydantic import ValidationError

from contract.job import FINAL_STATES, Job, JobState

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)


def job(**changes: Any) -> Job:
    values = dict.fromkeys(Job.model_fields) | {
        "id": "j",
        "kind": "export",
        "state": JobState.RUNNING,
        "progress": 0.5,
        "attempts": 1,
        "created_at": NOON,
    }
    return Job.model_validate(values | changes)


def test_a_job_of_any_kind_is_shown() -> None:
    document = job().model_dump(mode="json")
    assert (document["kind"], document["state"], document["surgery_id"]) == ("export", "running", None)
    assert document["created_at"] == "2026-11-21T12:00:00Z"


@pytest.mark.parametrize(
    "changes", [{"progress": 1.1}, {"state": "lost"}, {"created_at": datetime(2026, 1, 1)}, {"kind": None}]
)
def test_what_no_job_can_be_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        job(**changes)


def test_a_queued_or_running_job_has_not_ended() -> None:
    assert set(JobState) - FINAL_STATES == {JobState.QUEUED, JobState.RUNNING}
