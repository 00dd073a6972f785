"""A new kind of job in one file: no table, no migration, no other code that knows it."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from contract.event import Actor
from spinewatch.errors import ParameterError
from spinewatch.progress import Progress
from store import events
from store.leases import Lease
from workers.registry import Handler


class EchoHandler(Handler[str, str]):
    """Repeats the word in the payload and stores it as an event."""

    kind = "echo"

    def load(self, session: Session, lease: Lease) -> str:
        word: Any = lease.payload["word"]
        return str(word)

    def run(self, work: str, progress: Progress) -> str:
        progress("repeat", 0.5)
        if work == "nothing":
            raise ParameterError("there is no word to repeat; give one")
        return f"{work} {work}"

    def store(
        self, session: Session, lease: Lease, result: str, now: datetime, actor: Actor
    ) -> tuple[str, ...]:
        events.append(session, now, actor, f"echo:{result}", lease.subject_id, lease.surgery_id)
        return ()
