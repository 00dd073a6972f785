"""The bell: tells the workers that a job waits. It may be lost or rung twice; the job's row decides."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from huey import SqliteHuey  # type: ignore[import-untyped]
from huey.registry import Message  # type: ignore[import-untyped]

_BUSY_SECONDS = 5


class JobQueue:
    """A queue of job ids in an SQLite file of its own; ``answer`` is what a worker does with an id.

    Without ``answer`` the bell can be rung but not answered. Every process must make its own.
    """

    def __init__(self, path: Path, answer: Callable[[str], None] | None = None) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.huey = SqliteHuey(
            "spinewatch",
            results=False,
            serializer=_JsonSerializer(),
            filename=str(path),
            timeout=_BUSY_SECONDS,
            fsync=False,  # a lost ring is rung again
        )

        def measure(job_id: str) -> None:
            if answer is not None:
                answer(job_id)

        self._task = self.huey.task(name="measure")(measure)

    def ring(self, job_id: str) -> None:
        """Tell that a job waits."""
        self._task(job_id)

    def waiting(self) -> set[str]:
        """Return the ids that were rung and not yet answered."""
        return {task.args[0] for task in self.huey.pending()}

    def close(self) -> None:
        """Close the connection."""
        self.huey.storage.close()


class _JsonSerializer:
    """Messages as JSON: the default is pickle, which runs what it reads."""

    def serialize(self, message: Message) -> bytes:
        return json.dumps(message).encode()

    def deserialize(self, data: bytes) -> Message:
        return Message(*json.loads(data))
