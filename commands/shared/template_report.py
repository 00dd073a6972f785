"""Tables of a template set that was just built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from spinewatch.detection.candidates.property_spaces import PropertySpace
    from spinewatch.detection.candidates.template_building import BuiltSet
    from spinewatch.detection.candidates.templates import TemplateSet, TemplateTree

_LOG_WIDTH = 100


def print_built_set(built: BuiltSet) -> None:
    """Print the number of classes with the silhouettes behind it, and the proximities of each tree's templates."""
    _print(_classes(built.templates, built.silhouettes))
    print_proximities({f"{side} {space}": tree for (side, space), tree in built.templates.trees.items()})


def print_proximities(trees: Mapping[str, TemplateTree]) -> None:
    """Print the proximities of the templates of each tree."""
    for table in _proximities(trees):
        _print(table)


def _classes(templates: TemplateSet, silhouettes: Mapping[PropertySpace, Mapping[int, float]]) -> Table:
    counts = sorted({count for values in silhouettes.values() for count in values})
    columns = ["space", "classes", *map(str, counts)]
    table = _table("Classes, and the mean silhouette of each number of classes", columns)
    for (side, space), tree in templates.trees.items():
        if side != "left":  # both sides have as many classes
            continue
        values = silhouettes.get(space, {})
        row = (f"{values[count]:.3f}" if count in values else "" for count in counts)
        table.add_row(space, str(len(tree.representatives)), *row)
    return table


def _proximities(trees: Mapping[str, TemplateTree]) -> Sequence[Table]:
    from spinewatch.detection.candidates.template_samples import tree_proximities  # noqa: PLC0415

    tables = []
    for name, tree in trees.items():
        matrix = tree_proximities(tree)
        names = ["root", *(str(k) for k in range(1, len(matrix)))]
        table = _table(f"Proximity of {name} templates", ["", *names, "row mean"])
        for i, (label, row) in enumerate(zip(names, matrix, strict=True)):
            cells = ["" if j < i else f"{value:.3f}" for j, value in enumerate(row)]
            table.add_row(label, *cells, f"{row.mean():.3f}")
        tables.append(table)
    return tables


def _table(title: str, columns: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, show_edge=False)
    table.padding = (0, 1, 0, 0)
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if i else "left", no_wrap=True)
    return table


def _print(table: Table) -> None:
    console = Console()
    if not console.is_terminal:
        console = Console(width=_LOG_WIDTH)
    console.print(table, "")
