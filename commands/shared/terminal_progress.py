"""Progress of a computation in this process: a bar on a terminal, nothing in a log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn
from rich.progress import Progress as ProgressBar

from spinewatch.progress import Progress


@contextmanager
def terminal_progress() -> Iterator[Progress]:
    """Yield a callback that shows the step and the fraction done on stderr while the block runs."""
    console = Console(stderr=True)
    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.description}"))
    with ProgressBar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda step, fraction: bar.update(task, completed=fraction, description=step)
