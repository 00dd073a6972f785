"""Settings of all tests: one thread of linear algebra, no time limit per example, and no process that stays."""

from collections.abc import Iterator

import pytest
from hypothesis import settings

import commands  # noqa: F401 - sets the number of threads before NumPy is imported
from tests import backends
from tests.processes import left_behind, mark_children

settings.register_profile("spinewatch", deadline=None)  # a busy machine is no failure
settings.load_profile("spinewatch")


@pytest.fixture(scope="session", autouse=True)
def no_process_stays() -> Iterator[str]:
    """Fail after the last test, and after the services that tests share, if a process that they started runs on."""
    mark = mark_children()
    yield mark
    left = left_behind(mark)
    assert not left, "processes were left behind:\n" + "\n".join(left)


@pytest.fixture(scope="session", autouse=True)
def no_server_stays(no_process_stays: str) -> Iterator[None]:
    """End the servers that tests have shared."""
    yield
    backends.end_session()
