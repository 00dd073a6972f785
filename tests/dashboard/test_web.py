"""The sources of the page: types, tests of its logic, and the committed bundle."""

from __future__ import annotations

import filecmp
from pathlib import Path

import pytest

from tests.dashboard.web import BUILT, NotAvailableError, packages, run
from tests.paths import PROJECT


@pytest.fixture(autouse=True)
def _packages() -> None:
    try:
        packages()
    except NotAvailableError as error:
        pytest.skip(str(error))


def test_the_types_are_those_of_the_api_and_fit(tmp_path: Path) -> None:
    run("openapi-typescript", str(PROJECT / "openapi" / "openapi.json"), "--output", "src/api/schema.ts",
        "--default-non-nullable", "false")  # fmt: skip
    run("tsc", "--noEmit")


def test_the_logic_of_the_page() -> None:
    run("vitest", "run")


def test_the_committed_page_is_built_from_these_sources(tmp_path: Path) -> None:
    run("vite", "build", "--outDir", str(tmp_path), "--emptyOutDir")
    built, committed = (
        sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
        for folder in (tmp_path, BUILT)
    )
    assert built == committed, "run `make web`"
    assert filecmp.cmpfiles(tmp_path, BUILT, built, shallow=False) == (built, [], []), "run `make web`"
