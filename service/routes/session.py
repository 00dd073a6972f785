"""The session of a browser: a cookie made from an API key, and who a client is."""

from __future__ import annotations

from datetime import timedelta

from fastapi import APIRouter, Depends, Request, Response

from contract.session import Identity
from service.access import COOKIE, Principal
from service.dependencies import ActorDep, DatabaseDep, PrincipalDep, problems
from service.idempotency import refuse_key
from service.problems import KeyRequiredError
from service.turns import WriteTurn
from store import keys, sessions
from store.clock import utc_now

router = APIRouter(prefix="/v1/session", tags=["access"])


@router.post("", status_code=201, dependencies=[Depends(refuse_key), WriteTurn], responses=problems(422))
def create_session(
    request: Request, response: Response, database: DatabaseDep, actor: ActorDep, principal: PrincipalDep
) -> Identity:
    """Start a session with the API key in the Authorization header; the answer sets its cookie.

    The cookie is a secret, which is not stored, so that no Idempotency-Key is taken.
    """
    if principal.session_token is not None:
        raise KeyRequiredError("send the API key itself to start a session: Authorization: Bearer KEY")
    now = utc_now()
    duration: timedelta = request.app.state.session_duration
    with database.write() as session:
        row, token = sessions.start(session, keys.get(session, principal.prefix), now, duration, actor)
    response.set_cookie(
        COOKIE,
        token,
        max_age=int((row.expires_at - now).total_seconds()),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
        path="/",
    )
    response.headers["Cache-Control"] = "no-store"
    identity = _identity(principal)
    return identity.model_copy(update={"session": True, "expires_at": row.expires_at})


@router.get("", responses=problems())
def get_session(principal: PrincipalDep, response: Response) -> Identity:
    """Get who the client is: the key that was sent, or that of the session, and what it permits."""
    response.headers["Cache-Control"] = "no-store"
    return _identity(principal)


@router.delete("", status_code=204, dependencies=[WriteTurn], responses=problems())
def delete_session(
    database: DatabaseDep, actor: ActorDep, principal: PrincipalDep, response: Response
) -> None:
    """End the session of the cookie, if there is one, and remove the cookie."""
    if principal.session_token is not None:
        with database.write() as session:
            sessions.end(session, principal.session_token, utc_now(), actor)
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")


def _identity(principal: Principal) -> Identity:
    return Identity(
        key=principal.prefix,
        name=principal.name,
        scopes=sorted(principal.scopes),
        session=principal.session_token is not None,
        expires_at=principal.expires_at,
    )
