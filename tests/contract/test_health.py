import pytest
from pydantic import ValidationError

from contract.health import HealthCheck, NotReady

CHECK = {"name": "workers", "ok": False, "figure": 0.0, "limit": 1.0, "unit": "1", "detail": "no worker runs"}


def test_a_check_has_a_known_name() -> None:
    assert HealthCheck.model_validate(CHECK).limit == 1
    with pytest.raises(ValidationError):
        HealthCheck.model_validate({**CHECK, "name": "weather"})


def test_what_is_not_ready_is_a_problem_with_its_checks() -> None:
    problem = {
        "type": "urn:spinewatch:problem:not-ready",
        "title": "Not ready",
        "status": 503,
        "detail": "no worker",
    }
    not_ready = NotReady.model_validate({**problem, "checks": [CHECK]})
    assert not_ready.model_dump(exclude_none=True) == {**problem, "checks": [CHECK]}
