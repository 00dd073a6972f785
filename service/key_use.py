"""Times of the last use of keys, stored apart from the requests, which never wait for it."""

from __future__ import annotations

import queue
import threading
from datetime import datetime

import structlog
from sqlalchemy.exc import SQLAlchemyError

from store import keys
from store.database import Database

_MAX_WAITING = 256
_log = structlog.get_logger("service")


class KeyUse:
    """Stores uses of keys in a thread of its own, at most once a minute each; one that cannot be stored is dropped."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._stored: dict[str, datetime] = {}
        self._waiting: queue.Queue[tuple[str, datetime]] = queue.Queue(_MAX_WAITING)
        self._started = False

    def note(self, prefix: str, now: datetime) -> None:
        """Have the use of a key stored; returns at once. Called from one thread, that of the event loop."""
        last = self._stored.get(prefix)
        if last is not None and now - last < keys.LAST_USE_STEP:
            return
        if len(self._stored) > _MAX_WAITING:
            self._stored.clear()
        self._stored[prefix] = now
        if not self._started:
            self._started = True
            threading.Thread(target=self._store, name="key-use", daemon=True).start()
        try:
            self._waiting.put_nowait((prefix, now))
        except queue.Full:
            return

    def _store(self) -> None:
        while True:
            prefix, now = self._waiting.get()
            try:
                with self._database.write() as session:
                    keys.store_use(session, prefix, now)
            except SQLAlchemyError as error:
                _log.debug("key_use_not_stored", prefix=prefix, error=type(error).__name__)
