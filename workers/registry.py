"""Handlers of jobs by kind. A new kind is one file in workers/handlers/: no table, no other code refers to it."""

from __future__ import annotations

import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Iterable
from datetime import datetime
from importlib import import_module
from typing import Any, ClassVar, Generic, TypeVar

from sqlalchemy.orm import Session

from contract.event import Actor
from settings import Settings
from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from store.leases import Lease
from workers import handlers

Work = TypeVar("Work")
Result = TypeVar("Result")


class UnknownJobKindError(SpinewatchError):
    """No handler is registered for the kind of a job."""

    code = "unknown-job-kind"


class NotReadyError(Exception):
    """The work needs the end of another job: it goes back to the queue until then, and the attempt does not count.

    The other job must have been submitted before: jobs that waited for each other would never end.

    Parameters
    ----------
    job_id
        The other job.
    """

    def __init__(self, job_id: str) -> None:
        super().__init__(f"the work waits for the end of job {job_id}")
        self.job_id = job_id


class FilesWantedError(Exception):
    """The work needs files that were not loaded with its input: it is begun again with them.

    Parameters
    ----------
    sha256
        SHA-256 of each file, hexadecimal.
    """

    def __init__(self, sha256: frozenset[str]) -> None:
        super().__init__(f"the work needs {len(sha256)} more files")
        self.sha256 = sha256


class Handler(ABC, Generic[Work, Result]):
    """What is done for the jobs of one ``kind``: load the input, run the work, store the result.

    The input is loaded and the result stored in the worker; the work runs in the process of its jobs.
    """

    kind: ClassVar[str]

    @abstractmethod
    def load(self, session: Session, lease: Lease) -> Work:
        """Return the input of the work.

        Parameters
        ----------
        session
            Session that reads.
        lease
            The lease, with the subject and the payload.

        Returns
        -------
        Work
            The input.
        """

    def add_files(self, session: Session, work: Work, wanted: frozenset[str]) -> Work:
        """Return the input of the work with the files that it wanted; a handler that wants some has its own.

        Parameters
        ----------
        session
            Session that reads.
        work
            The input.
        wanted
            SHA-256 of each file, hexadecimal.

        Returns
        -------
        Work
            The input, with which the work wants no more.
        """
        raise NotImplementedError

    @abstractmethod
    def run(self, work: Work, progress: Progress) -> Result:
        """Return the result of the work; no session is open meanwhile.

        Parameters
        ----------
        work
            The input.
        progress
            Called at the start of each step; it raises when the lease is lost.

        Returns
        -------
        Result
            The result.

        Raises
        ------
        SpinewatchError
            The input cannot be used: the job fails by the error's name. After any other error it is tried again.
        NotReadyError
            The result depends on a job that was submitted before and has not ended.
        FilesWantedError
            The input lacks files.
        """

    def pack(self, result: Result) -> Any:
        """Return the result as ``store`` takes it, in the process of the work.

        Parameters
        ----------
        result
            The result.

        Returns
        -------
        object
            The result itself, unless a handler has a form that travels faster.
        """
        return result

    @abstractmethod
    def store(
        self, session: Session, lease: Lease, result: Any, now: datetime, actor: Actor
    ) -> tuple[str, ...]:
        """Store the result, in the transaction that ends the job and only while its lease is held.

        Parameters
        ----------
        session
            Session that writes.
        lease
            The lease, with the subject and the payload.
        result
            The result, as ``pack`` returned it.
        now
            Time of the result.
        actor
            The worker.

        Returns
        -------
        tuple of str
            Identifiers of the jobs that were added in the transaction; the worker enqueues them after the commit.
        """


class Registry:
    """Handlers by kind.

    Parameters
    ----------
    items
        The handlers.
    """

    def __init__(self, items: Iterable[Handler[Any, Any]] = ()) -> None:
        self._handlers: dict[str, Handler[Any, Any]] = {}
        for handler in items:
            self.register(handler)

    def register(self, handler: Handler[Any, Any]) -> None:
        """Add a handler.

        Parameters
        ----------
        handler
            The handler.

        Raises
        ------
        ValueError
            Its kind has a handler already.
        """
        if handler.kind in self._handlers:
            raise ValueError(f"two handlers of jobs of kind {handler.kind!r}; give each its own kind")
        self._handlers[handler.kind] = handler

    def handler(self, kind: str) -> Handler[Any, Any]:
        """Return the handler of a kind of job.

        Parameters
        ----------
        kind
            Kind of the job.

        Returns
        -------
        Handler
            Its handler.

        Raises
        ------
        UnknownJobKindError
            There is none.
        """
        try:
            return self._handlers[kind]
        except KeyError:
            raise UnknownJobKindError(
                f"this worker has no handler for jobs of kind {kind!r}; run workers of the service's own version"
            ) from None


def discover(settings: Settings) -> Registry:
    """Return a registry of the handlers in workers/handlers/.

    Parameters
    ----------
    settings
        Passed to the function ``handler`` of each module.

    Returns
    -------
    Registry
        One handler per module.
    """
    names = [module.name for module in pkgutil.iter_modules(handlers.__path__)]
    return Registry(import_module(f"{handlers.__name__}.{name}").handler(settings) for name in names)
