"""Who a client is and what it may do, decided from the headers of a request before any of its body is read."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from math import ceil

import structlog
from anyio import CapacityLimiter, to_thread
from fastapi import FastAPI
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Receive, Scope, Send

import contract.key
from contract.problem import Problem
from service.declared_routes import DeclaredRoutes
from service.failed_attempts import FailedAttempts
from service.key_use import KeyUse
from service.middleware.origins import same_host
from service.presence import deletion, surgery_of
from service.problems import database_problem, problem, problem_response
from service.scopes import Needed, is_open, needed_scopes
from store import keys, sessions, tables
from store.clock import utc_now
from store.database import Database
from store.errors import DatabaseNotReadyError, SurgeryDeletedError
from store.revision import require_revision

COOKIE = "spinewatch_session"
"""Name of the cookie that holds the token of a session."""

PRINCIPAL = "principal"
"""Name under which the state of a request holds its ``Principal``."""

REFUSED = "refused_principal"
"""Name under which the state of a refused request holds who made it, when that is known."""

_Refusal = tuple[Problem, Mapping[str, str]]
_SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
_MAX_KNOWN = 1024
_MAX_THREADS = 8
_log = structlog.get_logger("service")

_MISSING = (
    "this needs an API key: send it as Authorization: Bearer KEY; `spinewatch key create` makes one on the machine of"
    " the service"
)
_INVALID = (
    "the API key is unknown, revoked or expired; ask an administrator for another, or make one with"
    " `spinewatch key create`"
)
_ENDED = "the session has ended; open it again with an API key: POST /v1/session"
_FOREIGN = (
    "a cookie alone permits changes only to pages of this service, which browsers name in Sec-Fetch-Site or Origin;"
    " other programs send the key itself: Authorization: Bearer KEY"
)


@dataclass(frozen=True)
class Principal:
    """Who makes a request: the key, and the session if a cookie was sent instead of the key."""

    prefix: str
    name: str
    scopes: frozenset[contract.key.Scope]
    expires_at: datetime | None
    """End of the session, or of the key."""
    session_token: str | None
    """Token of the session; None when the key itself was sent."""

    def has(self, needed: Needed) -> bool:
        """Return whether the key has one of the scopes; ``admin`` includes the others."""
        return contract.key.Scope.ADMIN in self.scopes or bool(self.scopes & needed)


@dataclass(frozen=True)
class _Credential:
    """What a client sent to be let in."""

    secret: str
    is_session: bool

    @property
    def is_well_formed(self) -> bool:
        """Whether it can be a key or a token at all; anything else is refused without a look at the database."""
        form = sessions.TOKEN_FORM if self.is_session else keys.KEY_FORM
        return form.fullmatch(self.secret) is not None


@dataclass(frozen=True)
class _Identified:
    """Who makes a request, and whether the surgery that it is for was deleted."""

    principal: Principal
    deletion: SurgeryDeletedError | None = None


class Access:
    """ASGI middleware that answers 401 without a valid key or session, and 403 without the scope that a route needs.

    A surgery that was deleted is answered with 410 here, where the database is asked already.
    """

    def __init__(self, app: ASGIApp, routes: DeclaredRoutes) -> None:
        self._app = app
        self._routes = routes
        self._failed = FailedAttempts()
        self._known: OrderedDict[str, None] = OrderedDict()
        self._threads = CapacityLimiter(_MAX_THREADS)  # never behind requests that wait for the database
        # Addresses with too many failed attempts have one thread of their own, so that they hinder no others.
        self._doubted = CapacityLimiter(1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or is_open(scope["method"], scope["path"]):
            await self._app(scope, receive, send)
            return
        refused = await self._refused(scope)
        if refused is not None:
            response = problem_response(scope, *refused)
            await response(scope, receive, send)
            return
        await self._app(scope, receive, send)

    async def _refused(self, scope: Scope) -> _Refusal | None:
        """Return why a request is refused; otherwise its principal is in its state afterwards."""
        route = self._routes.find(scope["method"], scope["path"])
        template = None if route is None else route.path
        needed = needed_scopes(scope["method"], template)
        headers = Headers(scope=scope)
        credential = _credential(headers)
        if credential is None:
            return None if not needed else _unauthorized("key-missing", _MISSING)
        found = await self._identified(scope, credential, surgery_of(template, scope["path"]))
        if not isinstance(found, _Identified):
            return found
        principal = found.principal
        refused = _not_permitted(scope["method"], headers, principal, needed)
        if refused is None and found.deletion is not None:
            refused = problem(410, str(found.deletion), found.deletion.code), {}
        if refused is None:
            self._admit(scope, principal)
        else:
            scope.setdefault("state", {})[REFUSED] = principal
        return refused

    async def _identified(
        self, scope: Scope, credential: _Credential, surgery_id: str | None
    ) -> _Identified | _Refusal:
        """Return who sent a credential, or why the request is refused."""
        if not credential.is_well_formed:
            return _not_valid(credential)
        app: FastAPI = scope["app"]
        address = "" if scope.get("client") is None else scope["client"][0]
        digest = keys.digest(credential.secret)
        wait = 0.0 if digest in self._known else self._failed.wait_seconds(address, time.monotonic())
        threads = self._doubted if wait else self._threads
        try:
            found = await to_thread.run_sync(
                _identify, app.state.database, credential, surgery_id, utc_now(), limiter=threads
            )
        except DatabaseNotReadyError as error:
            return problem(503, str(error), error.code), {}
        except SQLAlchemyError as error:
            return database_problem(error)
        if found is None and wait:
            detail = f"too many failed attempts from this address; wait {ceil(wait)} s and send a valid key"
            return problem(429, detail, "too-many-attempts"), {"Retry-After": str(ceil(wait))}
        if found is None:
            self._fail(digest, address)
            return _not_valid(credential)
        self._remember(digest)
        return found

    def _admit(self, scope: Scope, principal: Principal) -> None:
        """Let the routes and the log know who makes a request."""
        structlog.contextvars.bind_contextvars(key=principal.prefix)
        scope.setdefault("state", {})[PRINCIPAL] = principal
        use: KeyUse = scope["app"].state.key_use
        use.note(principal.prefix, utc_now())

    def _fail(self, digest: str, address: str) -> None:
        """Count a failed attempt."""
        self._known.pop(digest, None)
        self._failed.add(address, time.monotonic())
        _log.warning("access_refused", address=address)

    def _remember(self, digest: str) -> None:
        """Keep what was valid, so that others' failed attempts from the same address do not delay it."""
        self._known[digest] = None
        self._known.move_to_end(digest)
        if len(self._known) > _MAX_KNOWN:
            self._known.popitem(last=False)


def _credential(headers: Headers) -> _Credential | None:
    """Return the key of the Authorization header, else the token of the cookie; an empty one is never valid."""
    sent = headers.getlist("authorization")
    if sent:
        scheme, _, secret = sent[0].partition(" ")
        usable = len(sent) == 1 and scheme.lower() == "bearer"
        return _Credential(secret.strip() if usable else "", is_session=False)
    token = cookie_parser("; ".join(headers.getlist("cookie"))).get(COOKIE)
    return None if not token else _Credential(token, is_session=True)


def _identify(
    database: Database, credential: _Credential, surgery_id: str | None, now: datetime
) -> _Identified | None:
    """Return who sent a credential, None when it is not valid; with whether the surgery was deleted, in one look."""
    try:
        with database.read() as session:
            principal = _sender(session, credential, now)
            if principal is None or surgery_id is None:
                return None if principal is None else _Identified(principal)
            return _Identified(principal, deletion(session, surgery_id))
    except SQLAlchemyError:
        require_revision(database)  # says what to do where there are no tables
        raise


def _sender(session: Session, credential: _Credential, now: datetime) -> Principal | None:
    if not credential.is_session:
        key = keys.authenticate(session, credential.secret, now)
        return None if key is None else _principal(key, key.expires_at, None)
    row = sessions.find(session, credential.secret, now)
    return None if row is None else _principal(row.key, row.expires_at, credential.secret)


def _principal(key: tables.access.ApiKey, expires_at: datetime | None, token: str | None) -> Principal:
    scopes = frozenset(contract.key.Scope(scope) for scope in key.scopes)
    return Principal(key.prefix, key.name, scopes, expires_at, token)


def _not_permitted(method: str, headers: Headers, principal: Principal, needed: Needed) -> _Refusal | None:
    """Return why somebody who is known may not do this."""
    if principal.session_token is not None and method not in _SAFE and not _from_own_page(headers):
        return problem(403, _FOREIGN, "foreign-origin"), {}
    return _forbidden(principal, needed) if needed and not principal.has(needed) else None


def _from_own_page(headers: Headers) -> bool:
    """Return whether a browser says that a page of this service makes the request."""
    site = headers.get("sec-fetch-site")
    if site is not None:
        return site.lower() == "same-origin"
    return same_host(headers.get("origin", ""), headers.get("host", ""))


def _unauthorized(code: str, detail: str, error: str | None = None) -> _Refusal:
    challenge = 'Bearer realm="spinewatch"' + (f', error="{error}"' if error else "")
    return problem(401, detail, code), {"WWW-Authenticate": challenge}


def _not_valid(credential: _Credential) -> _Refusal:
    if credential.is_session:
        return _unauthorized("session-ended", _ENDED)
    return _unauthorized("key-invalid", _INVALID, "invalid_token")


def _forbidden(principal: Principal, needed: Needed) -> _Refusal:
    names = sorted(needed)
    detail = (
        f"the key {principal.name!r} ({principal.prefix}) lacks the scope {' or '.join(names)}; use another key, or"
        " have an administrator make one with it"
    )
    challenge = f'Bearer realm="spinewatch", error="insufficient_scope", scope="{" ".join(names)}"'
    return problem(403, detail, "scope-missing"), {"WWW-Authenticate": challenge}
