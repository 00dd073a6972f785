import pytest
from pydantic import ValidationError

from contract.event import Actor, ActorKind
from store.tables.events import Event


def test_an_actor_fits_its_columns() -> None:
    columns = Event.__table__.columns
    assert max(len(kind.value) for kind in ActorKind) <= columns["actor_kind"].type.length  # type: ignore[attr-defined]
    longest = columns["actor_name"].type.length  # type: ignore[attr-defined]
    Actor(kind=ActorKind.HTTP, name="x" * longest)
    with pytest.raises(ValidationError):
        Actor(kind=ActorKind.HTTP, name="x" * (longest + 1))


def test_an_actor_has_a_kind() -> None:
    with pytest.raises(ValidationError):
        Actor.model_validate({"kind": "nobody", "name": "x"})
