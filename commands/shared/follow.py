"""Shows how jobs get on: bars on a terminal, lines in a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import monotonic, sleep

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from commands.shared.api_client import ApiClient, Document, ServiceError, Submitted

_FINAL = frozenset({"succeeded", "failed", "cancelled"})
_POLL_SECONDS = 0.1
_LIMIT_SECONDS = 180.0


def follow(cart: ApiClient, stages: Sequence[Submitted]) -> Mapping[str, Document]:
    """Poll the jobs of all stages until each has ended; return the last answer by stage name.

    Raises ``ServiceError`` when one has not ended after three minutes.
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
        end = monotonic() + _LIMIT_SECONDS
        while open_stages := [stage for stage in stages if not _ended(jobs.get(stage.name))]:
            if monotonic() > end:
                names = ", ".join(stage.name for stage in open_stages)
                raise ServiceError(
                    f"{names} not measured after {_LIMIT_SECONDS:.0f} s; see the service's log"
                )
            for stage in open_stages:
                job = jobs[stage.name] = cart.get(stage.job_path)
                bars.update(tasks[stage.name], completed=job["progress"], step=job["step"] or job["state"])
                if _ended(job):
                    bars.update(tasks[stage.name], step=job["state"])
                    bars.stop_task(tasks[stage.name])
                    if not console.is_terminal:
                        console.print(f"{stage.name}: {job['state']}")
            sleep(_POLL_SECONDS)
    return jobs


def _ended(job: Document | None) -> bool:
    return job is not None and job["state"] in _FINAL
