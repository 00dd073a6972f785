"""The tree in docs/architecture.md: ``python -m checks.architecture`` compares it, ``--write`` writes it.

Each folder is described by the first line of its ``__init__`` docstring and followed by its modules.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

PROJECT = Path(__file__).parents[1]
PAGE = PROJECT / "docs" / "architecture.md"
ROOMS = (
    "spinewatch",
    "contract",
    "exports",
    "reports",
    "settings",
    "store",
    "workers",
    "service",
    "commands",
    "migrations",
    "bench",
    "training",
    "checks",
)
_BLOCK = re.compile(r"(?<=<!-- tree -->\n```text\n).*?(?=```\n<!-- /tree -->)", re.DOTALL)
_WIDTH = 26


def tree() -> str:
    """Return the tree of every room, its folders and their modules."""
    return "".join(line for room in ROOMS for line in _lines(PROJECT / room, 0))


def main(arguments: Sequence[str]) -> int:
    """Write the tree into the page, or return 1 when the page shows another one."""
    text = PAGE.read_text(encoding="utf-8")
    expected = _BLOCK.sub(lambda _: tree(), text)
    if not _BLOCK.search(text):
        sys.stderr.write("docs/architecture.md has no block <!-- tree -->\n")
        return 1
    if "--write" in arguments:
        PAGE.write_text(expected, encoding="utf-8")
        return 0
    if text == expected:
        return 0
    sys.stderr.write(
        "docs/architecture.md differs from the tree; run: python -m checks.architecture --write\n"
    )
    return 1


def _lines(folder: Path, depth: int) -> Iterator[str]:
    name = "  " * depth + f"{folder.name}/"
    yield f"{name:<{_WIDTH}} {_summary(folder / '__init__.py')}\n"
    modules = sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("__"))
    indent = "  " * (depth + 1)
    line = indent
    for module in modules:
        if len(line) + len(module) > 108:
            yield f"{line.rstrip()}\n"
            line = indent
        line += f"{module}  "
    if line.strip():
        yield f"{line.rstrip()}\n"
    for child in sorted(folder.iterdir()):
        if (child / "__init__.py").exists():
            yield from _lines(child, depth + 1)


def _summary(init: Path) -> str:
    docstring = ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""
    return " ".join(docstring.split("\n\n")[0].split()).rstrip(".")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
