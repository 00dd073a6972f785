"""What the documents promise is there, and what is there is documented."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from spinewatch.flags import FLAGS
from tests.paths import PROJECT

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
)
DOCUMENTS = [
    *sorted(PROJECT.glob("*.md")),
    *sorted((PROJECT / "docs").glob("*.md")),
    PROJECT / "samples" / "README.md",
]


def sources() -> Iterator[Path]:
    for room in ROOMS:
        yield from sorted((PROJECT / room).rglob("*.py"))


def first_column(path: Path) -> set[str]:
    rows = re.findall(r"^\| (`.*?) \|", path.read_text(), re.M)
    return {name for row in rows for name in re.findall(r"`([^`]+)`", row)}


def raised_flags() -> set[str]:
    calls = (node for path in sources() for node in ast.walk(ast.parse(path.read_text())))
    return {
        call.args[0].value
        for call in calls
        if isinstance(call, ast.Call)
        and getattr(call.func, "id", getattr(call.func, "attr", "")) == "Flag"
        and call.args
        and isinstance(call.args[0], ast.Constant)
        and isinstance(call.args[0].value, str)
    }


def test_every_flag_is_raised_somewhere_and_no_other() -> None:
    assert raised_flags() == set(FLAGS)


def test_every_dependency_has_its_reason() -> None:
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())
    groups = project["dependency-groups"].values()
    extras = project["project"]["optional-dependencies"].values()
    wanted = [*project["project"]["dependencies"], *(name for group in (*groups, *extras) for name in group)]
    names = {re.split(r"[=<>\[]", requirement)[0] for requirement in wanted}
    assert names == first_column(PROJECT / "docs" / "dependencies.md")


def test_direct_dependencies_are_locked_at_their_version() -> None:
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())
    run = (PROJECT / "requirements.lock").read_text()
    dev = (PROJECT / "requirements-dev.lock").read_text()
    extras = [name for group in project["project"]["optional-dependencies"].values() for name in group]
    wanted = [*project["project"]["dependencies"], *extras]
    for requirement in (re.sub(r"\[.*?\]", "", text) for text in wanted):
        assert re.search(rf"^{re.escape(requirement)}[ ;\\]", run, re.M), requirement
        assert re.search(rf"^{re.escape(requirement)}[ ;\\]", dev, re.M), requirement
    for requirement in project["dependency-groups"]["dev"]:
        assert re.search(rf"^{re.escape(requirement)}[ ;\\]", dev, re.M), requirement


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", document.read_text()):
        assert (document.parent / target).exists(), target


def test_named_make_targets_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (PROJECT / "Makefile").read_text(), re.M))
    for document in DOCUMENTS:
        assert set(re.findall(r"`make ([a-z-]+)", document.read_text())) <= targets


def test_readme_python_runs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (PROJECT / "README.md").read_text(), re.S)
    monkeypatch.chdir(PROJECT)
    exec(compile(code, "README.md", "exec"), {})  # noqa: S102 - our own text
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["L1", "T11", "T9", "T7"]


def test_dockerfile_copies_what_is_there_and_sent_to_it() -> None:
    ignore = (PROJECT / ".dockerignore").read_text().splitlines()
    sent = {line[1:] for line in ignore if line.startswith("!")}
    copies = re.findall(r"^COPY (?!--from)(.+)$", (PROJECT / "Dockerfile").read_text(), re.M)
    copied = {source for copy in copies for source in copy.split()[:-1]}
    assert copied == sent
    for source in copied:
        assert (PROJECT / source).exists(), source


def test_result_picture_is_small() -> None:
    assert (PROJECT / "docs" / "img" / "result.png").stat().st_size < 300_000
