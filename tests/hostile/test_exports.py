"""What exports and plans cost is not the server's, however many are asked for at once."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from tests.hostile.attack import MAX_DELAY_S, MAX_MEMORY_BYTES, forget_peak, harmless, peak_memory
from tests.hostile.liveness import Liveness
from tests.http.harness import SAMPLE, Service, pair, wait_for


@pytest.fixture(scope="module")
def working(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service with one worker."""
    with Service(tmp_path_factory.mktemp("exporting")) as service:
        service.start("worker")
        yield service


@pytest.fixture(scope="module")
def with_spine(working: Service) -> str:
    """The path of a surgery whose one stage has a spine."""
    path = f"/v1/surgeries/{working.surgery()}"
    setup = json.loads((SAMPLE / "spine.json").read_text())
    assert working.client.put(f"{path}/spine", json=setup).status_code == 200
    working.submit(path.rpartition("/")[2], "PRE", pair("PRE"), working.calibration())
    wait_for(lambda: working.client.get(f"{path}/stages/PRE/spine").status_code == 200, "the spine")
    return path


@pytest.mark.parametrize("name", ["dicom-sr", "report-pdf", "fhir"])
def test_exports_that_are_asked_for_together_are_made_in_turns(
    working: Service, with_spine: str, name: str
) -> None:
    def export(_: int) -> httpx.Response:
        return working.client.get(f"{with_spine}/exports/{name}")

    with ThreadPoolExecutor(6) as pool, harmless(working, requests=6):
        answers = list(pool.map(export, range(6)))
    assert {answer.status_code for answer in answers} == {200}
    assert len({answer.content for answer in answers}) == 1


def test_plans_that_are_asked_for_together_are_computed_in_turns(working: Service) -> None:
    levels = [*(f"L{n}" for n in range(5, 0, -1)), *(f"T{n}" for n in range(12, 0, -1))]
    levels += [f"C{n}" for n in range(7, 0, -1)]
    query = {"planes": "25", "levels": ",".join(levels)}
    plan = working.client.get("/v1/plans/accuracy", params=query)
    assert plan.status_code == 200, plan.text
    pid = working.server.pid
    forget_peak(pid)
    with ThreadPoolExecutor(40) as pool, Liveness(working) as another_client:
        answers = pool.map(lambda _: working.client.get("/v1/plans/accuracy", params=query), range(40))
        assert {answer.content for answer in answers} == {plan.content}
    assert another_client.delay_s <= MAX_DELAY_S
    assert peak_memory(pid) < MAX_MEMORY_BYTES
