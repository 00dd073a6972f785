"""The process in which a worker runs its jobs: when a job takes too much, the process ends and the worker goes on."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from typing import Any

import structlog

from settings import Settings
from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from workers.fork_server import Forked, ForkServer, ForkServerEndedError
from workers.job_loop import Broke, OutOfMemory, Progressed, Refused, Returned, Waits, WantsFiles, run_jobs
from workers.registry import FilesWantedError, NotReadyError, Registry

_CHECK_SECONDS = 0.2
_GRACE_SECONDS = 0.5
_UNAVAILABLE_STATUS = 69  # EX_UNAVAILABLE
_log = structlog.get_logger("worker")


class JobOverdueError(SpinewatchError):
    """A job took too long; it is not tried again."""

    code = "job-overdue"


class JobOutOfMemoryError(SpinewatchError):
    """A job needed too much memory; it is not tried again."""

    code = "job-out-of-memory"


class JobCrashedError(SpinewatchError):
    """A job ended its process; it is not tried again."""

    code = "job-crashed"


class JobKilledError(Exception):
    """The process of a job was killed from outside, which says nothing of the job: another attempt may succeed."""


class JobRefusedError(SpinewatchError):
    """The handler refused the input, for a reason with a name of its own.

    Parameters
    ----------
    code
        Name of the reason.
    detail
        What is wrong and what to do.
    """

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code


class JobBrokeError(Exception):
    """The handler raised an error without a name, whose traceback is the message."""


class JobProcess:
    """Runs handlers in a process of its own, which lives until a job ends it.

    Make it before the worker has threads or a database (workers/fork_server.py).

    Parameters
    ----------
    registry
        Handlers by kind of job.
    settings
        Limits of a job.
    """

    def __init__(self, registry: Registry, settings: Settings) -> None:
        self._seconds = settings.max_run_seconds
        self._cpu_seconds = settings.max_cpu_seconds
        memory = settings.worker_memory_bytes
        self._server = ForkServer(lambda link: run_jobs(link, registry, memory, self._cpu_seconds))
        self._process: Forked | None = self._server.fork()

    def run(self, kind: str, work: Any, progress: Progress, check: Callable[[], None]) -> Any:
        """Return the result of a handler.

        Parameters
        ----------
        kind
            Kind of the job.
        work
            Input of the handler.
        progress
            Called when a step begins.
        check
            Called from time to time. Whatever it or ``progress`` raises ends the process.

        Returns
        -------
        object
            The result.

        Raises
        ------
        JobRefusedError
            The handler refused the input.
        NotReadyError
            The work waits for another job.
        FilesWantedError
            The input lacks files.
        JobBrokeError
            The handler raised another error.
        JobOverdueError
            The work took more time than allowed.
        JobOutOfMemoryError
            The work needed more memory than allowed.
        JobCrashedError
            The process ended otherwise.
        """
        try:
            process = self._ready()
            try:
                return self._run(process, kind, work, progress, check)
            except (EOFError, OSError) as error:
                raise self._death() from error
            except (JobRefusedError, NotReadyError, FilesWantedError):
                raise
            except BaseException:
                self._end()
                raise
        except ForkServerEndedError:
            _log.error("job_server_ended")
            os._exit(
                _UNAVAILABLE_STATUS
            )  # no fault of the job: its lease expires and another worker takes it

    def _run(
        self, process: Forked, kind: str, work: Any, progress: Progress, check: Callable[[], None]
    ) -> Any:
        deadline = time.monotonic() + self._seconds
        link = process.connection
        link.send((kind, work))
        while True:
            if not link.poll(_CHECK_SECONDS):
                check()
                if time.monotonic() > deadline:
                    raise JobOverdueError(
                        f"the job was ended after {self._seconds:g} s and is not tried again; see docs/operations.md"
                    )
                continue
            match link.recv():
                case Progressed(step, fraction):
                    progress(step, fraction)
                case Returned(result):
                    return result
                case Refused(code, detail):
                    raise JobRefusedError(code, detail)
                case Waits(job_id):
                    raise NotReadyError(job_id)
                case WantsFiles(sha256):
                    raise FilesWantedError(sha256)
                case OutOfMemory():
                    raise _out_of_memory()
                case Broke(report):
                    raise JobBrokeError(report)

    def _ready(self) -> Forked:
        """Return the process, or a new one if it has ended."""
        if self._process is not None and self._process.connection.poll(0):  # nothing is sent between jobs
            _log.warning("job_process_ended", status=self._server.wait(self._process))
            self._process = None
        if self._process is None:
            self._process = self._server.fork()
        return self._process

    def _death(self) -> Exception:
        """Return why the process ended by itself."""
        status = self._server.wait(self._require())
        self._process = None
        _log.error("job_process_ended", status=status)
        if status == -signal.SIGXCPU:
            return JobOverdueError(
                f"the job was ended after {self._cpu_seconds:g} s of CPU time and is not tried again; see"
                " docs/operations.md"
            )
        if status == -signal.SIGKILL:
            time.sleep(_GRACE_SECONDS)  # whoever kills all processes of a worker ends this one too
            return JobKilledError("the process of the job was killed; the machine may be short of memory")
        how = f"signal {-status}" if status < 0 else f"exit status {status}"
        return JobCrashedError(
            f"the job ended its process ({how}) and is not tried again; see the workers' log"
        )

    def _end(self) -> None:
        """End the process: what it does is not wanted, or it may be in disorder."""
        process = self._require()
        process.kill()
        self._process = None
        self._server.wait(process)

    def _require(self) -> Forked:
        if self._process is None:
            raise ForkServerEndedError
        return self._process


def _out_of_memory() -> JobOutOfMemoryError:
    return JobOutOfMemoryError(
        "the job needed more memory than a worker may have and is not tried again; send smaller images, or raise"
        " SPINEWATCH_WORKER_MEMORY_BYTES"
    )
