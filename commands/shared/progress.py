"""The progress of a step by step computation: a bar on a terminal, nothing in a log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from spinewatch.progress import Progress as Report


@contextmanager
def terminal_progress() -> Iterator[Report]:
    """Yield a callback that shows the step and the fraction done on standard error while the block runs."""
    console = Console(stderr=True)
    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda step, fraction: bar.update(task, completed=fraction, description=step)
