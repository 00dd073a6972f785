"""Progress of jobs in the service: bars on a terminal, lines in a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import monotonic, sleep

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from commands.shared.api_client import ApiClient, Document, ServiceError, SubmittedStage

_FINAL = frozenset({"succeeded", "failed", "cancelled"})
_POLL_SECONDS = 0.1
_TIMEOUT_SECONDS = 180.0


def wait_for_jobs(
    client: ApiClient, stages: Sequence[SubmittedStage], timeout_seconds: float = _TIMEOUT_SECONDS
) -> Mapping[str, Document]:
    """Poll the jobs of stages until all have ended; return the jobs by the name of the stage.

    Raises ``ServiceError`` after the timeout.
    """
    console = Console()
    jobs: dict[str, Document] = {}
    columns = (
        TextColumn("{task.description:>6}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[step]}"),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        tasks = {stage.name: bars.add_task(stage.name, total=1.0, step="") for stage in stages}
        deadline = monotonic() + timeout_seconds
        while unfinished := [stage for stage in stages if not _ended(jobs.get(stage.name))]:
            if monotonic() > deadline:
                names = ", ".join(stage.name for stage in unfinished)
                raise ServiceError(
                    f"{names} not measured after {timeout_seconds:.0f} s; see the service's log"
                )
            for stage in unfinished:
                job = jobs[stage.name] = client.get(stage.job_path)
                step = job["state"] if _ended(job) else job["step"] or job["state"]
                bars.update(tasks[stage.name], completed=job["progress"], step=step)
                if _ended(job):
                    bars.stop_task(tasks[stage.name])
                    if not console.is_terminal:
                        console.print(f"{stage.name}: {job['state']}")
            sleep(_POLL_SECONDS)
    return jobs


def _ended(job: Document | None) -> bool:
    return job is not None and job["state"] in _FINAL
