"""Errors as application/problem+json (RFC 9457): each has a stable code, none the input that caused it."""

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

from contract.base import FieldError, Problem
from spinewatch.errors import RigError, SpinewatchError
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
"""The codes of problems without one of their own; Python's names for some changed from version to version."""

_PLAIN_KEY = re.compile(r"[\w.-]{1,64}", re.ASCII)
_log = structlog.get_logger("service")


class InvalidInputError(SpinewatchError):
    """A named part of the request cannot be used; ``field`` says which, ``index`` which of that name."""

    def __init__(self, field: str, error: SpinewatchError, index: int | None = None) -> None:
        super().__init__(f"{field if index is None else f'{field} {index + 1}'}: {error}")
        self.code = error.code
        self.loc: list[str | int] = ["body", field] if index is None else ["body", field, index]


def problem(
    status: int, detail: str, code: str | None = None, errors: Sequence[FieldError] | None = None
) -> Problem:
    """Return a problem; without a ``code`` it is named after its status."""
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
    """Return the response that carries a problem; ``instance`` names the request."""
    request_id = scope.get("state", {}).get("request_id")
    if request_id:
        problem = problem.model_copy(update={"instance": f"urn:spinewatch:request:{request_id}"})
    body = problem.model_dump(mode="json", exclude_none=True)
    return JSONResponse(body, problem.status, headers=headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Let every error that leaves a route be a problem."""
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
            headers = {"Allow": ", ".join(_methods(request))}
        return problem_response(request.scope, made, headers)

    return handle


def _methods(request: Request) -> list[str]:
    """Return what a path takes: the error names the methods of the first route there, not of them all."""
    paths = request.app.openapi()["paths"]
    matching = (path for path in paths if compile_path(path)[0].match(request.url.path))
    methods = {method.upper() for path in matching for method in paths[path]} or {"GET"}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


def _http_problem(error: HTTPException) -> tuple[Problem, Mapping[str, str] | None]:
    detail = {
        404: "nothing is served at this path; see /docs",
        405: "this path does not take this method; see the Allow header",
    }.get(error.status_code, str(error.detail))
    return problem(error.status_code, detail), error.headers


def _validation_problem(error: RequestValidationError) -> tuple[Problem, None]:
    errors = [
        FieldError(loc=[_safe(part) for part in entry["loc"]], msg=entry["msg"], type=entry["type"])
        for entry in error.errors()
    ]
    return problem(422, "the request does not fit its schema; see errors", "invalid-request", errors), None


def _named_problem(error: SpinewatchError) -> tuple[Problem, None]:
    status = next((status for kind, status in _STATUS if isinstance(error, kind)), 422)
    errors = None
    if isinstance(error, RigError):
        errors = [FieldError(loc=["body", *error.field.split(".")], msg=error.problem, type=error.code)]
    elif isinstance(error, InvalidInputError):
        errors = [FieldError(loc=error.loc, msg=str(error), type=error.code)]
    return problem(status, str(error), error.code, errors), None


def _database_problem(error: OperationalError) -> tuple[Problem, Mapping[str, str]]:
    _log.error("record_unavailable", error=str(error.orig))
    return problem(503, "the record cannot be used now; try again", "record-unavailable"), {
        "Retry-After": "1"
    }


def _safe(part: str | int) -> str | int:
    return part if isinstance(part, int) or _PLAIN_KEY.fullmatch(part) else "(unprintable)"
