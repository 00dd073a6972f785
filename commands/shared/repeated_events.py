"""A filter of log records: an event that repeats itself is logged once a minute, with the number left out."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from time import monotonic
from typing import Any

_EVERY_SECONDS = 60.0
_MAX_KNOWN = 256
_OWN_LINE = frozenset({"job_id", "request_id"})
"""What makes an event one of its own: the log has each of them."""

_REPEATED = frozenset({"database_unavailable", "job_not_enqueued"})
"""Events that every request and job has while the cause lasts; their own lines and answers name them."""


@dataclass
class _Known:
    """When an event was logged last, and how often it was left out since."""

    logged: float
    left_out: int = 0


class RepeatedEvents(logging.Filter):
    """Lets a warning or an error pass once a minute if it differs from the last one in nothing but its time.

    A periodic action that fails each second, on a full disk for example, would fill the disk with its own log.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._known: dict[Hashable, _Known] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record is logged; one that was left out before has ``repeated`` with the number."""
        if record.levelno < logging.WARNING:
            return True
        fields = record.msg if isinstance(record.msg, dict) else {}
        event = fields.get("event", record.msg)
        if _OWN_LINE & fields.keys() and event not in _REPEATED:
            return True
        error = _error(record, fields)
        cause = getattr(error, "orig", error)  # SQLAlchemy's own text has the time in its parameters
        key = (record.name, str(event), fields.get("thread"), fields.get("error"), type(error), str(cause))
        now = monotonic()
        with self._lock:
            known = self._known.get(key)
            if known is not None and now - known.logged < _EVERY_SECONDS:
                known.left_out += 1
                return False
            if known is None and len(self._known) >= _MAX_KNOWN:
                self._known.pop(next(iter(self._known)))
            self._known[key] = _Known(now)
        if known is not None and known.left_out:
            if isinstance(record.msg, dict):
                record.msg = {**record.msg, "repeated": known.left_out}
            else:
                record.msg = f"{record.msg} (repeated {known.left_out} times)"
        return True


def _error(record: logging.LogRecord, fields: Mapping[str, Any]) -> BaseException | None:
    """Return the exception that is logged with a record; structlog names it in the fields."""
    given = record.exc_info or fields.get("exc_info")
    if given is True:
        return sys.exc_info()[1]
    return given[1] if isinstance(given, tuple) else given or None
