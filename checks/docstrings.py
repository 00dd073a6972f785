"""Whether public docstrings have the numpydoc sections that are due: ``python -m checks.docstrings``.

Due are: Parameters with every argument of a public function, method or class; Returns or Yields where something is
returned; Attributes with every public field of a dataclass. Special methods and properties need a summary only, which
the linter checks.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from docstring_parser import Docstring, DocstringStyle, parse

PROJECT = Path(__file__).parents[1]
ROOMS = ("spinewatch", "store", "workers", "exports", "reports")

Function = ast.FunctionDef | ast.AsyncFunctionDef


def main() -> int:
    """Print one line per docstring that lacks something; return 1 when there is any."""
    missing = [
        line for room in ROOMS for path in sorted((PROJECT / room).rglob("*.py")) for line in check(path)
    ]
    sys.stdout.write("".join(f"{line}\n" for line in missing))
    sys.stdout.write(f"{len(missing)} public docstrings lack a section that is due\n")
    return int(bool(missing))


def check(path: Path) -> Iterator[str]:
    """Yield what the docstrings of a module lack, as file, line, name and sentence."""
    for name, node in _public(ast.parse(path.read_text()).body):
        doc = parse(ast.get_docstring(node) or "", DocstringStyle.NUMPYDOC)
        for sentence in _lacking(node, doc):
            yield f"{path.relative_to(PROJECT)}:{node.lineno}: {name}: {sentence}"


def _public(body: Sequence[ast.stmt], prefix: str = "") -> Iterator[tuple[str, ast.ClassDef | Function]]:
    for node in body:
        if not isinstance(
            node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
        ) or node.name.startswith("_"):
            continue
        yield prefix + node.name, node
        if isinstance(node, ast.ClassDef):
            yield from _public(node.body, f"{node.name}.")


def _lacking(node: ast.ClassDef | Function, doc: Docstring) -> Iterator[str]:
    if isinstance(node, ast.ClassDef):
        init = next((m for m in node.body if isinstance(m, ast.FunctionDef) and m.name == "__init__"), None)
        if init is not None:
            yield from _compare("Parameters", _arguments(init), _names(doc, "param"))
        if "dataclass" in _decorators(node):
            yield from _compare("Attributes", _fields(node), _names(doc, "attribute"))
        return
    if {"property", "cached_property", "overload"} & _decorators(node):
        return
    yield from _compare("Parameters", _arguments(node), _names(doc, "param"))
    returns = node.returns is not None and ast.unparse(node.returns) not in {"None", "NoReturn"}
    if returns and not doc.many_returns:
        yield "has no Returns or Yields"


def _compare(section: str, due: set[str], given: set[str]) -> Iterator[str]:
    if due - given:
        yield f"{section} lacks {', '.join(sorted(due - given))}"
    if given - due:
        yield f"{section} has {', '.join(sorted(given - due))}, which is not there"


def _names(doc: Docstring, section: str) -> set[str]:
    entries = (entry.arg_name for entry in doc.params if entry.args[0] in {section, f"other_{section}"})
    return {name.strip().lstrip("*") for entry in entries for name in entry.split(",")}


def _arguments(function: Function) -> set[str]:
    a = function.args
    named = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
    return {argument.arg for argument in named} - {"self", "cls"}


def _fields(node: ast.ClassDef) -> set[str]:
    names = {
        item.target.id
        for item in node.body
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
    }
    return {name for name in names if not name.startswith("_")}


def _decorators(node: ast.ClassDef | Function) -> set[str]:
    calls = (item.func if isinstance(item, ast.Call) else item for item in node.decorator_list)
    return {call.attr if isinstance(call, ast.Attribute) else getattr(call, "id", "") for call in calls}


if __name__ == "__main__":
    sys.exit(main())
