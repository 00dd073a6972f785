"""The sample surgery as the API has it."""

from __future__ import annotations

from typing import Any

from tests.http.harness import SAMPLE, Service, pair, wait_for

STAGES = ("PRE", "INTER", "POST")


def configure(service: Service, surgery: str) -> None:
    """Store the setup of the spine of the sample."""
    answer = service.client.put(
        f"/v1/surgeries/{surgery}/spine",
        content=(SAMPLE / "spine.json").read_bytes(),
        headers={"Content-Type": "application/json"},
    )
    assert answer.status_code == 200, answer.text


def summary(service: Service, surgery: str) -> dict[str, Any]:
    """Return the summary of a surgery."""
    document: dict[str, Any] = service.client.get(f"/v1/surgeries/{surgery}/summary").json()
    return document


def spines_are_computed(service: Service, surgery: str) -> bool:
    """Return whether every stage of a surgery has its spine."""
    return all(stage["spine"] is not None for stage in summary(service, surgery)["stages"])


def measured_surgery(service: Service) -> str:
    """Measure the sample surgery over HTTP, and return its identifier when its spines are computed."""
    calibration, surgery = service.calibration(), service.surgery()
    configure(service, surgery)
    jobs = [service.submit(surgery, name, pair(name), calibration) for name in STAGES]
    assert [service.finished(job)["state"] for job in jobs] == ["succeeded"] * len(STAGES)
    wait_for(lambda: spines_are_computed(service, surgery), "the spines")
    return surgery
