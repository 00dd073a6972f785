"""API keys, for administrators: they are made, listed and revoked; a secret is shown once."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Response

from contract.key import CreatedKey, Key, NewKey
from contract.page import Listing
from service.dependencies import ActorDep, DatabaseDep, json_body, problems
from service.idempotency import refuse_key
from service.paging import CreatedSort, CursorText, Limit, Paging
from service.turns import WriteTurn
from store import keys, tables
from store.clock import utc_now

router = APIRouter(prefix="/v1/keys", tags=["access"])

Prefix = Annotated[str, Path(description="Visible part of the key.")]


@router.post(
    "",
    status_code=201,
    dependencies=[Depends(refuse_key), Depends(json_body), WriteTurn],
    responses=problems(413, 415, 422),
)
def create_key(new: NewKey, database: DatabaseDep, actor: ActorDep, response: Response) -> CreatedKey:
    """Make a key; the answer is the only one that contains it, so that no Idempotency-Key is taken."""
    with database.write() as session:
        row, secret = keys.add(session, new, utc_now(), actor)
    response.headers["Location"] = f"{router.prefix}/{row.prefix}"
    response.headers["Cache-Control"] = "no-store"
    return CreatedKey(**key_of(row).model_dump(), key=secret)


@router.get("", responses=problems(422))
def list_keys(
    database: DatabaseDep,
    limit: Limit = 50,
    sort: CreatedSort = "-created_at",
    cursor: CursorText = None,
) -> Listing[Key]:
    """List all keys, also revoked and expired ones."""
    paging = Paging(limit, sort, cursor)
    with database.read() as session:
        page = keys.listed(session, paging.wanted)
    return Listing(**paging.document(page, [key_of(row) for row in page.items]))


@router.get("/{prefix}", responses=problems(404))
def get_key(prefix: Prefix, database: DatabaseDep) -> Key:
    """Get a key without its secret."""
    with database.read() as session:
        return key_of(keys.get(session, prefix))


@router.delete("/{prefix}", dependencies=[WriteTurn], responses=problems(404))
def revoke_key(prefix: Prefix, database: DatabaseDep, actor: ActorDep) -> Key:
    """Refuse a key, and every session made from it, from now on; its name stays in the list and in the audit."""
    with database.write() as session:
        return key_of(keys.revoke(session, prefix, utc_now(), actor))


def key_of(row: tables.access.ApiKey) -> Key:
    """Return the model of a row."""
    return Key.model_validate(row)
