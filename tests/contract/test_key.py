from typing import Any

import pytest
from pydantic import ValidationError

from contract.key import NewKey, Scope


def test_scopes_arrive_as_text() -> None:
    new = NewKey.model_validate({"name": "cart 1", "scopes": ["capture:write", "stage:read"]})
    assert new.scopes == [Scope.CAPTURE_WRITE, Scope.STAGE_READ]
    assert new.expires_in_days is None


@pytest.mark.parametrize(
    "change",
    [
        {"name": ""},
        {"name": " cart"},
        {"name": "c\u00e1rt"},
        {"name": "a\nb"},
        {"name": "x" * 65},
        {"scopes": []},
        {"scopes": ["read"]},
        {"scopes": ["admin", "admin"]},
        {"expires_in_days": 0},
        {"expires_in_days": 4000},
        {"expires_in_days": "1"},
        {"key": "sw_mine"},
    ],
)
def test_anything_else_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        NewKey.model_validate({"name": "cart 1", "scopes": ["stage:read"], **change})
