"""Tables of the keys, the browsers' sessions and the idempotency keys."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship, synonym

from store.tables.base import Base, Document


class ApiKey(Base):
    """A key of the HTTP API (``contract.key.Key``); of the key itself only the SHA-256 is stored."""

    __tablename__ = "api_keys"

    prefix: Mapped[str] = mapped_column(String(16), primary_key=True)
    id: Mapped[str] = synonym("prefix")
    key_sha256: Mapped[str] = mapped_column(String(64))
    name: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[list[Any]]
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]
    last_used_at: Mapped[datetime | None]


class ApiSession(Base):
    """A session of a browser, made from a key; of the token in its cookie only the SHA-256 is stored."""

    __tablename__ = "api_sessions"

    token_sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    key_prefix: Mapped[str] = mapped_column(ForeignKey("api_keys.prefix"), index=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]

    key: Mapped[ApiKey] = relationship(lazy="raise")


class IdempotencyKey(Base):
    """The answer to a request with an ``Idempotency-Key``; ``scope`` is whose key it is."""

    __tablename__ = "idempotency_keys"

    scope: Mapped[str] = mapped_column(String(128), primary_key=True)
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    status: Mapped[int]
    headers: Mapped[Document]
    body: Mapped[str] = mapped_column(Text)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime] = mapped_column(index=True)
