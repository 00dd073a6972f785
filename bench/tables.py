"""Tables for the terminal, for a log file and for a document."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

_LOG_WIDTH = 160


@dataclass(frozen=True)
class Grid:
    """A table of text."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, title: str, columns: Iterable[object], rows: Iterable[Iterable[object]]) -> Grid:
        """Return a table of whatever can be shown as text."""
        return cls(title, tuple(map(str, columns)), tuple(tuple(map(str, row)) for row in rows))

    def print(self) -> None:
        """Print it as wide as the terminal, or wide enough for a row in a file."""
        grid = Table(*self.columns, title=self.title, title_justify="left", title_style="bold")
        for row in self.rows:
            grid.add_row(*row)
        Console(width=None if sys.stdout.isatty() else _LOG_WIDTH).print(grid)

    def markdown(self) -> str:
        """Return it as Markdown."""
        lines = [self.columns, ("---",) * len(self.columns), *self.rows]
        table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
        return f"**{self.title}**\n\n{table}\n"


@dataclass(frozen=True)
class Bar:
    """Something that was promised: what it asks for, what was reached, and whether that is enough."""

    promise: str
    reached: str
    holds: bool


def bars(checks: Iterable[Bar]) -> Grid:
    """Return the table of bars."""
    rows = ((bar.promise, bar.reached, "ok" if bar.holds else "MISSED") for bar in checks)
    return Grid.of("Bars", ["bar", "reached", ""], rows)
