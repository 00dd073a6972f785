import json

from contract.key import Scope
from contract.session import Identity


def test_an_identity_is_written_with_plain_scopes() -> None:
    identity = Identity(
        key="abcdefgh", name="dashboard", scopes=[Scope.STAGE_READ], session=True, expires_at=None
    )
    document = json.loads(identity.model_dump_json())
    assert document["scopes"] == ["stage:read"]
    assert Identity.model_validate(document) == identity
