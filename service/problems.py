"""Errors as application/problem+json (RFC 9457): each has a stable code; none repeats the input."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import OperationalError
from starlette.exceptions import HTTPException
from starlette.routing import compile_path

from contract.problem import FieldError, Problem
from spinewatch.errors import RigError, SpinewatchError
from spinewatch.levels import ExtraLevelError, LevelError
from store.errors import ConflictError, DatabaseNotReadyError, NotFoundError

MEDIA_TYPE = "application/problem+json"

_TYPE = "urn:spinewatch:problem:"
_STATUS: tuple[tuple[type[SpinewatchError], int], ...] = (
    (NotFoundError, 404),
    (ConflictError, 409),
    (DatabaseNotReadyError, 503),
)
STATUS_NAMES = {
    400: "bad-request",
    404: "not-found",
    405: "method-not-allowed",
    409: "conflict",
    413: "content-too-large",
    415: "unsupported-media-type",
    422: "unprocessable-content",
    500: "internal-error",
    503: "service-unavailable",
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
    body = problem.model_dump(mode="json", exclude_none=True)
    return JSONResponse(body, problem.status, headers=headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Answer every error raised by a route with a problem."""
    app.add_exception_handler(HTTPException, _handler(_http_problem))
    app.add_exception_handler(RequestValidationError, _handler(_validation_problem))
    app.add_exception_handler(SpinewatchError, _handler(_named_problem))
    app.add_exception_handler(OperationalError, _handler(_database_problem))


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
    paths = request.app.openapi()["paths"]
    matching = (path for path in paths if compile_path(path)[0].match(request.url.path))
    methods = {method.upper() for path in matching for method in paths[path]} or {"GET"}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


def _http_problem(error: HTTPException) -> tuple[Problem, Mapping[str, str] | None]:
    detail = {
        404: "there is no such path; see /docs",
        405: "this path does not support this method; see the Allow header",
    }.get(error.status_code, str(error.detail))
    return problem(error.status_code, detail), error.headers


def _validation_problem(error: RequestValidationError) -> tuple[Problem, None]:
    errors = [
        FieldError(loc=[_safe(part) for part in entry["loc"]], msg=entry["msg"], type=entry["type"])
        for entry in error.errors()
    ]
    return problem(422, "the request does not match its schema; see errors", "invalid-request", errors), None


def _named_problem(error: SpinewatchError) -> tuple[Problem, None]:
    status = next((status for kind, status in _STATUS if isinstance(error, kind)), 422)
    errors = None
    if isinstance(error, RigError):
        errors = [FieldError(loc=["body", *error.field.split(".")], msg=error.problem, type=error.code)]
    elif isinstance(error, LevelError):
        field = "extra_levels" if isinstance(error, ExtraLevelError) else "vertebrae"
        loc: list[str | int] = ["body", field] if error.index is None else ["body", field, error.index]
        errors = [FieldError(loc=loc, msg=str(error), type=error.code)]
    elif isinstance(error, InvalidInputError):
        errors = [FieldError(loc=error.loc, msg=str(error), type=error.code)]
    return problem(status, str(error), error.code, errors), None


def _database_problem(error: OperationalError) -> tuple[Problem, Mapping[str, str]]:
    _log.error("database_unavailable", error=str(error.orig))
    return problem(503, "the database is not available; try again", "database-unavailable"), {
        "Retry-After": "1"
    }


def _safe(part: str | int) -> str | int:
    """Return a part of a location; a key that a client made up may be anything, and is not repeated."""
    return part if isinstance(part, int) or _SAFE_KEY.fullmatch(part) else "(unprintable)"
