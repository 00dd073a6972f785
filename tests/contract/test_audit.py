import json

import pytest
from pydantic import ValidationError

from contract.audit import AuditEvent

EVENT = {
    "seq": 1, "at": "2026-11-21T12:00:00Z", "action": "surgery:created", "resource": "surgery", "subject_id": "s",
    "surgery_id": None, "actor_kind": "http", "actor_name": "cart", "actor_key": None, "address": None,
    "request_id": None, "outcome": "refused", "detail": None, "hash": "0" * 64,
}  # fmt: skip


def test_an_event_survives_json() -> None:
    event = AuditEvent.model_validate_json(json.dumps(EVENT))
    assert event.model_dump(mode="json") == EVENT


@pytest.mark.parametrize(
    "change", [{"outcome": "maybe"}, {"actor_kind": "ghost"}, {"at": "2026-11-21T12:00:00"}]
)
def test_what_no_event_has_is_refused(change: dict[str, str]) -> None:
    with pytest.raises(ValidationError):
        AuditEvent.model_validate(EVENT | change)
