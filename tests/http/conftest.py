from collections.abc import Iterator

import pytest

from tests.http.harness import Service, pair


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service with two workers that all tests of a session share; each test has its own surgery."""
    with Service(tmp_path_factory.mktemp("service")) as service:
        service.start("worker")
        service.start("worker")
        yield service


@pytest.fixture(scope="session")
def idle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service without workers; a test that starts some kills them (``kill_workers``)."""
    with Service(tmp_path_factory.mktemp("idle")) as service:
        yield service


@pytest.fixture(scope="module")
def calibration(service: Service) -> str:
    return service.calibration()


@pytest.fixture
def surgery(service: Service) -> str:
    return service.surgery()


@pytest.fixture(scope="module")
def measured(service: Service, calibration: str) -> str:
    """A surgery whose stages PRE, INTER and POST have been measured."""
    surgery = service.surgery()
    jobs = [service.submit(surgery, name, pair(name), calibration) for name in ("PRE", "INTER", "POST")]
    assert [service.finished(job)["state"] for job in jobs] == ["succeeded"] * 3
    return surgery
