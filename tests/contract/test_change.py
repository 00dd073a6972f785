import json

import pytest
from pydantic import ValidationError

from contract.change import Change, Changes

CHANGE = {
    "seq": 117,
    "at": "2026-11-21T09:30:00Z",
    "kind": "stage",
    "action": "stage:measured",
    "id": "a",
    "surgery_id": "b",
    "stage": "PRE",
    "take": 1,
}


def test_a_page_has_changes_and_where_to_go_on() -> None:
    change = Change.model_validate_json(json.dumps(CHANGE))
    page = Changes(changes=[change], last=change.seq, done=True)
    assert Changes.model_validate_json(page.model_dump_json()) == page


@pytest.mark.parametrize("name", list(CHANGE))
def test_nothing_of_a_change_may_be_missing(name: str) -> None:
    with pytest.raises(ValidationError):
        Change.model_validate_json(json.dumps({key: value for key, value in CHANGE.items() if key != name}))
