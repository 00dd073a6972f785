"""Requests that are carried out once: a repeated one with the same ``Idempotency-Key`` has the same answer.

See draft-ietf-httpapi-idempotency-key-header. The answer is stored in the transaction of what the request changes, and
writers take turns: of two requests with one key, also at the same time, the second one finds the answer of the first.
Only answers of success are stored; a request that was refused may be corrected and sent again with its key. While the
job that a request submitted has not ended, the repeated request is a conflict that names the job.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import Depends, FastAPI, Header, Request, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile

from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from service.dependencies import ActorDep, DatabaseDep
from spinewatch.errors import SpinewatchError
from store import idempotency
from store.clock import utc_now
from store.database import Database
from store.errors import ConflictError
from store.idempotency import Answer, KeyUse
from store.tables.jobs import Job

REPLAYED = "Idempotency-Replayed"
"""Header of an answer that was given before."""

_JOBS = "/v1/jobs/"
_CHUNK_BYTES = 1024 * 1024
_HEADER = Header(
    alias="Idempotency-Key",
    pattern=r'^("[ !#-~]{1,200}"|[!#-~]{1,200})$',
    description="A text that names this request, for example a UUID: sent again with the same key within 24 hours, the"
    " request is not carried out again but has the same answer, or 409 with the job in Location while its job has not"
    " ended.",
    examples=['"8e03978e-40d5-43dd-bc93-6894a57f9324"'],
)


class JobNotEndedError(ConflictError):
    """The request was carried out before, and the job that it submitted has not ended."""

    code = "job-not-ended"

    def __init__(self, job_id: str, state: JobState) -> None:
        super().__init__(
            f"this request was accepted before and its job is {state}; follow the job in Location"
        )
        self.job_id = job_id


class IdempotencyKeyRefusedError(SpinewatchError):
    """The answer contains a secret, which is never stored, so that it cannot be given again."""

    code = "idempotency-key-refused"


class Replay(Exception):  # noqa: N818 - no error: the request was carried out before
    """The request was carried out before, with this answer."""

    def __init__(self, answer: Answer) -> None:
        super().__init__("the request was carried out before")
        self.answer = answer


class Once:
    """What one request changes; with a key it is changed once, however often the request is sent.

    Parameters
    ----------
    database
        The database.
    use
        Returns the use of the key of the request, in the thread that writes; None without a key.
    """

    def __init__(self, database: Database, use: Callable[[], KeyUse] | None) -> None:
        self._database = database
        self._find_use = use
        self._use: KeyUse | None = None
        self._session: Session | None = None

    @contextmanager
    def write(self) -> Iterator[Session]:
        """Open a session that writes, unless the request was carried out before.

        Raises ``Replay`` then, or ``JobNotEndedError`` while the job that it submitted has not ended.
        """
        self._use = None if self._find_use is None else self._find_use()
        with self._database.write() as session:
            if self._use is not None:
                answer = idempotency.find(session, self._use, utc_now())
                if answer is not None:
                    _require_ended_job(session, answer)
                    raise Replay(answer)
            self._session = session
            yield session
            self._session = None

    def answer(self, document: BaseModel, status: int, **headers: str | None) -> Response:
        """Return the answer, within the session that writes; headers are named with underscores, None is left out."""
        if self._session is None:
            raise RuntimeError("the answer must be made within the session that writes")
        sent = {name.replace("_", "-"): value for name, value in headers.items() if value is not None}
        answer = Answer(status, sent, document.model_dump_json(by_alias=True))
        if self._use is not None:
            idempotency.add(self._session, self._use, answer, utc_now())
        return _response(answer)


async def _once(
    request: Request,
    database: DatabaseDep,
    actor: ActorDep,
    key: Annotated[str | None, _HEADER] = None,
) -> Once:
    if key is None:
        return Once(database, None)
    return Once(database, partial(_use, _scope(actor), key.strip('"'), *await _content(request)))


OnceDep = Annotated[Once, Depends(_once)]


def refuse_key(request: Request) -> None:
    """Raise ``IdempotencyKeyRefusedError`` for a request with a key whose answer contains a secret."""
    if _HEADER.alias in request.headers:
        raise IdempotencyKeyRefusedError(
            "the answer contains a secret, which is not stored, so that it cannot be given again; leave Idempotency-Key"
            " out, and revoke or end what a lost answer has made"
        )


def install(app: FastAPI) -> None:
    """Answer a request that was carried out before with the answer that it had."""

    async def replay(_: Request, error: Exception) -> Response:
        assert isinstance(error, Replay)  # noqa: S101 - the handler is of this class
        return _response(error.answer, {REPLAYED: "true"})

    app.add_exception_handler(Replay, replay)


def _require_ended_job(session: Session, answer: Answer) -> None:
    """Raise ``JobNotEndedError`` for the answer of a request whose job is queued or running."""
    path = answer.headers.get("Location", "")
    if answer.status != HTTPStatus.ACCEPTED or not path.startswith(_JOBS):
        return
    job = session.get(Job, path.removeprefix(_JOBS))
    if job is not None and job.state not in FINAL_STATES:
        raise JobNotEndedError(job.id, job.state)


def _scope(actor: Actor) -> str:
    return actor.key or actor.name


def _response(answer: Answer, headers: Mapping[str, str] | None = None) -> Response:
    return Response(
        answer.body, answer.status, {**answer.headers, **(headers or {})}, media_type="application/json"
    )


async def _content(request: Request) -> tuple[list[str], list[tuple[str, Any]]]:
    """Return what tells a request from another; of a form its parts count, not how they were packed."""
    head = [request.method, request.url.path, request.url.query]
    if request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        return head, (await request.form()).multi_items()
    return head, [("body", (await request.body()).decode("latin-1"))]


def _use(scope: str, key: str, head: Iterable[str], parts: Iterable[tuple[str, Any]]) -> KeyUse:
    return KeyUse(scope, key, _digest(head, parts))


def _digest(head: Iterable[str], parts: Iterable[tuple[str, Any]]) -> str:
    digest = hashlib.sha256()
    for text in head:
        _add(digest, text.encode())
    for name, value in parts:
        _add(digest, name.encode())
        _add(digest, _of_file(value) if isinstance(value, UploadFile) else value.encode("utf-8", "replace"))
    return digest.hexdigest()


def _add(digest: Any, content: bytes) -> None:
    """Add bytes after their length, so that no two lists of parts have the same digest."""
    digest.update(len(content).to_bytes(8, "big"))
    digest.update(content)


def _of_file(upload: UploadFile) -> bytes:
    """Return the digest of a file, which is read in pieces and left at its start."""
    digest = hashlib.sha256()
    upload.file.seek(0)
    while chunk := upload.file.read(_CHUNK_BYTES):
        digest.update(chunk)
    upload.file.seek(0)
    return digest.digest()
