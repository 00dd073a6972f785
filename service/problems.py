"""Errors as application/problem+json (RFC 9457): each has a stable code; none repeats the input."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from http import HTTPStatus
from itertools import islice
from typing import Any

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException

from contract.problem import FieldError, Problem
from contract.setup_checks import SpineSetupError
from service.declared_routes import DeclaredRoutes
from service.etags import PreconditionFailedError, PreconditionRequiredError
from service.key_turns import TooBusyError
from service.limits import MAX_ERRORS
from spinewatch.errors import MissingPackageError, RigError, SpinewatchError
from spinewatch.levels import ExtraLevelError, LevelError
from store.errors import (
    ConflictError,
    DatabaseNotReadyError,
    ImageDamagedError,
    NotFoundError,
    SurgeryDeletedError,
)
from store.unavailable import disk_is_full, is_unavailable

MEDIA_TYPE = "application/problem+json"


class KeyRequiredError(SpinewatchError):
    """The request needs the API key itself, not a session made from one."""

    code = "key-required"


class AccessEndedError(SpinewatchError):
    """The key or the session of a client became invalid while its request was waiting."""

    code = "access-ended"


class TooManyWaitingError(SpinewatchError):
    """The key of a client has as many streams and waiting requests as it may have."""

    code = "too-many-waiting"


_TYPE = "urn:spinewatch:problem:"
_STATUS: tuple[tuple[type[SpinewatchError], int], ...] = (
    (NotFoundError, 404),
    (ConflictError, 409),
    (DatabaseNotReadyError, 503),
    (TooBusyError, 503),
    (MissingPackageError, 501),
    (AccessEndedError, 401),
    (TooManyWaitingError, 429),
    (KeyRequiredError, 403),
    (SurgeryDeletedError, 410),
    (PreconditionFailedError, 412),
    (PreconditionRequiredError, 428),
    (ImageDamagedError, 500),
)
STATUS_NAMES = {
    400: "bad-request",
    401: "unauthorized",
    403: "forbidden",
    404: "not-found",
    405: "method-not-allowed",
    408: "request-timeout",
    409: "conflict",
    410: "gone",
    412: "precondition-failed",
    413: "content-too-large",
    414: "uri-too-long",
    415: "unsupported-media-type",
    417: "expectation-failed",
    421: "misdirected-request",
    422: "unprocessable-content",
    428: "precondition-required",
    429: "too-many-requests",
    431: "headers-too-large",
    500: "internal-error",
    501: "not-implemented",
    503: "service-unavailable",
    505: "http-version-not-supported",
    507: "insufficient-storage",
}
"""Codes of problems without their own; ``http.HTTPStatus`` has other names in other versions of Python."""

_SAFE_KEY = re.compile(r"[\w.-]{1,64}", re.ASCII)
_log = structlog.get_logger("service")


class InvalidInputError(SpinewatchError):
    """A field of a form or, with ``part``, of the query cannot be used: its file number ``index``, or all of it."""

    def __init__(
        self, field: str, error: SpinewatchError, index: int | None = None, part: str = "body"
    ) -> None:
        super().__init__(f"{field if index is None else f'{field} {index + 1}'}: {error}")
        self.code = error.code
        self.loc: list[str | int] = [part, field] if index is None else [part, field, index]


def problem(
    status: int, detail: str, code: str | None = None, errors: Sequence[FieldError] | None = None
) -> Problem:
    """Return a problem; the default ``code`` is that of the status."""
    name = code or STATUS_NAMES.get(status, f"http-{status}")
    return Problem(
        type=_TYPE + name,
        title=name.replace("-", " ").capitalize(),
        status=status,
        detail=detail,
        errors=None if errors is None else list(errors),
    )


def problem_response(
    scope: Mapping[str, Any], problem: Problem, headers: Mapping[str, str] | None = None
) -> Response:
    """Return the response with a problem; ``instance`` is the identifier of the request."""
    request_id = scope.get("state", {}).get("request_id")
    if request_id:
        problem = problem.model_copy(update={"instance": f"urn:spinewatch:request:{request_id}"})
    return JSONResponse(problem.members(), problem.status, headers=headers, media_type=MEDIA_TYPE)


def field_errors(entries: Iterable[tuple[Sequence[str | int], str, str]]) -> list[FieldError]:
    """Return the errors of a problem from place, sentence and kind; at most ``MAX_ERRORS``."""
    return [
        FieldError(loc=[_safe(part) for part in place], msg=sentence, type=kind)
        for place, sentence, kind in islice(entries, MAX_ERRORS)
    ]


def install(app: FastAPI) -> None:
    """Answer every error raised by a route with a problem."""
    app.add_exception_handler(HTTPException, _handler(_http_problem))
    app.add_exception_handler(RequestValidationError, _handler(_validation_problem))
    app.add_exception_handler(SpinewatchError, _handler(_named_problem))
    app.add_exception_handler(SQLAlchemyError, _handler(database_problem))


def _handler(
    make: Callable[[Any], tuple[Problem, Mapping[str, str] | None]],
) -> Callable[[Request, Exception], Awaitable[Response]]:
    async def handle(request: Request, error: Exception) -> Response:
        made, headers = make(error)
        if made.status == HTTPStatus.METHOD_NOT_ALLOWED:
            headers = {"Allow": ", ".join(_allowed_methods(request))}
        return problem_response(request.scope, made, headers)

    return handle


def _allowed_methods(request: Request) -> list[str]:
    """Return the methods of all routes at a path; the error itself has only those of the first."""
    return DeclaredRoutes(request.app.routes).methods(request.url.path) or ["GET", "HEAD"]


def _http_problem(error: HTTPException) -> tuple[Problem, Mapping[str, str] | None]:
    if isinstance(error.__cause__, OSError) and error.status_code == HTTPStatus.BAD_REQUEST:
        _log.error("upload_not_stored", error=str(error.__cause__.strerror))
        return problem(
            507, "the upload cannot be stored; make room in the folder TMPDIR of the service"
        ), None
    detail = {
        404: "there is no such path; see /docs",
        405: "this path does not support this method; see the Allow header",
    }.get(error.status_code, str(error.detail))
    return problem(error.status_code, detail), error.headers


def _validation_problem(error: RequestValidationError) -> tuple[Problem, None]:
    found = error.errors()
    shown = f"the first {MAX_ERRORS} of {len(found)} " if len(found) > MAX_ERRORS else ""
    detail = f"the request does not match its schema; see {shown}errors"
    entries = [(entry["loc"], entry["msg"], entry["type"]) for entry in found[:MAX_ERRORS]]
    return problem(422, detail, "invalid-request", field_errors(entries)), None


def _named_problem(error: SpinewatchError) -> tuple[Problem, Mapping[str, str] | None]:
    status = next((status for kind, status in _STATUS if isinstance(error, kind)), 422)
    errors = None
    if isinstance(error, RigError):
        errors = [FieldError(loc=["body", *error.field.split(".")], msg=error.problem, type=error.code)]
    elif isinstance(error, LevelError):
        field = "extra_levels" if isinstance(error, ExtraLevelError) else "vertebrae"
        loc: list[str | int] = ["body", field] if error.index is None else ["body", field, error.index]
        errors = [FieldError(loc=loc, msg=str(error), type=error.code)]
    elif isinstance(error, SpineSetupError):
        errors = [FieldError(loc=["body", *error.path], msg=str(error), type=error.code)]
    elif isinstance(error, InvalidInputError):
        errors = [FieldError(loc=error.loc, msg=str(error), type=error.code)]
    headers = None
    if isinstance(error, AccessEndedError):
        headers = {"WWW-Authenticate": 'Bearer realm="spinewatch", error="invalid_token"'}
    if isinstance(error, TooManyWaitingError | TooBusyError):
        headers = {"Retry-After": "10"}
    job_id = getattr(error, "job_id", None) if isinstance(error, ConflictError) else None
    if job_id is not None:
        headers = {"Location": f"/v1/jobs/{job_id}"}
    return problem(status, str(error), error.code, errors), headers


def database_problem(error: SQLAlchemyError) -> tuple[Problem, Mapping[str, str]]:
    """Return the problem of a database that cannot be used now; another error, which is a defect, is raised again."""
    if not is_unavailable(error):
        raise error
    _log.error("database_unavailable", error=str(getattr(error, "orig", error)))
    detail = "the database is not available; try again"
    if disk_is_full(error):
        detail = (
            "the disk of the database is full, and nothing was stored; make room on it, then send this again"
        )
    return problem(503, detail, "database-unavailable"), {"Retry-After": "1"}


def _safe(part: str | int) -> str | int:
    """Return a part of a location; a key that a client made up may be anything, and is not repeated."""
    return part if isinstance(part, int) or _SAFE_KEY.fullmatch(part) else "(unprintable)"
