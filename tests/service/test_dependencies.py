import asyncio

import pytest
import structlog
from fastapi import Request

from contract.event import ActorKind
from contract.key import Scope
from service import dependencies
from service.access import PRINCIPAL, Principal
from service.dependencies import enqueue, problems
from store.queue import JobQueue


class BrokenQueue(JobQueue):
    def __init__(self) -> None: ...

    def enqueue(self, job_id: str) -> None:
        raise OSError("disk full")


def test_a_job_that_cannot_be_enqueued_is_logged_and_accepted() -> None:
    with structlog.testing.capture_logs() as lines:
        enqueue(BrokenQueue(), "j1")
    assert [(line["event"], line["job_id"]) for line in lines] == [("job_not_enqueued", "j1")]


def test_every_route_declares_the_problems_that_any_route_has() -> None:
    assert set(problems(404)) == {404, 500, 503}
    assert problems(415)[415]["description"] == "Unsupported media type"


def request_from(principal: Principal | None) -> Request:
    state = {"request_id": "r1"} if principal is None else {"request_id": "r1", PRINCIPAL: principal}
    return Request({"type": "http", "headers": [], "client": ("192.0.2.7", 1), "state": state})


def test_an_actor_has_key_name_address_and_request() -> None:
    principal = Principal("k3vq7mzd", "cart 1", frozenset({Scope.CAPTURE_WRITE}), None, None)
    actor = asyncio.run(dependencies._actor(request_from(principal)))
    assert (actor.kind, actor.name) == (ActorKind.HTTP, "k3vq7mzd cart 1")
    assert (actor.key, actor.address, actor.request_id) == ("k3vq7mzd", "192.0.2.7", "r1")


def test_without_a_key_an_actor_is_its_address() -> None:
    actor = asyncio.run(dependencies._actor(request_from(None)))
    assert (actor.name, actor.key, actor.address) == ("192.0.2.7", None, "192.0.2.7")
    with pytest.raises(RuntimeError, match="scopes"):
        asyncio.run(dependencies._principal(request_from(None)))
