"""Fixtures of the exports' tests: the example surgery, and validators that others wrote."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from contract.summary import SurgerySummary
from tests.contract.spine_results import summary as example
from tests.validators import node, slicer_reader
from tests.validators.installed import NotAvailableError


@pytest.fixture(scope="session")
def summary() -> SurgerySummary:
    """The example surgery: three measured stages, a fourth without a result."""
    return example()


@pytest.fixture(scope="session")
def validate() -> Callable[..., Any]:
    """Run a script of tests/validators by name with its arguments; return the JSON document that it prints."""
    try:
        node.packages()
    except NotAvailableError as reason:
        pytest.skip(f"validators from npm: {reason}")

    def run(script: str, *arguments: Path | str) -> Any:
        return node.validate(script, *arguments)

    return run


@pytest.fixture(scope="session")
def read_by_slicer() -> Callable[[Path], Any]:
    """Return what 3D Slicer's own libraries read from a file."""
    try:
        slicer_reader.packages()
    except NotAvailableError as reason:
        pytest.skip(f"3D Slicer's libraries: {reason}")
    return slicer_reader.read
