"""Bursts of pairs, times of exposure of each view, and labels by an earlier stage, through the service."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from store.queue import JobQueue
from tests.http.harness import Service, code_of, problem_of, wait_for
from tests.stage_images import T7_IN_INTER, Pair, sample, with_noise, without

STORED = """
    SELECT (SELECT count(*) FROM stages), (SELECT count(*) FROM jobs), (SELECT count(*) FROM images),
           (SELECT count(*) FROM events), (SELECT count(*) FROM further_pairs)
"""
START = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)
PAIRS = [with_noise(sample("PRE"), seed) for seed in range(6)]


def times(n: int, step_s: float = 1.0, late_s: float = 0.0) -> list[str]:
    return [(START + timedelta(seconds=k * step_s + late_s)).isoformat() for k in range(n)]


def send(
    service: Service, surgery: str, calibration: str, pairs: Sequence[Pair], name: str = "PRE", **fields: Any
) -> httpx.Response:
    files = [(side, (side, pair[k])) for k, side in enumerate(("left", "right")) for pair in pairs]
    data = {"name": name, "calibration_id": calibration, **fields}
    return service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files)


def measured(service: Service, surgery: str, answer: httpx.Response) -> dict[str, Any]:
    """Return the triads of a stage that was accepted."""
    assert answer.status_code == 202, answer.text
    job = service.finished(answer.json()["job"]["id"])
    assert job["state"] == "succeeded", job["error"]
    document: dict[str, Any] = service.client.get(
        f"/v1/surgeries/{surgery}/stages/{answer.json()['name']}/triads"
    ).json()
    return document


def burst_of(service: Service, surgery: str, name: str = "PRE") -> Any:
    return service.client.get(f"/v1/surgeries/{surgery}/stages/{name}/burst").json()["burst"]


def test_a_burst_is_one_job_whose_poses_are_means(service: Service, calibration: str) -> None:
    surgery, single = service.surgery(), service.surgery()
    answer = send(
        service,
        surgery,
        calibration,
        PAIRS,
        left_exposed_at=times(6),
        right_exposed_at=times(6, late_s=0.002),
    )
    assert answer.json()["pairs"] == 6
    assert answer.json()["left_exposed_at"] == "2026-11-21T09:30:00Z"
    assert answer.json()["right_exposed_at"] == "2026-11-21T09:30:00.002000Z"
    result = measured(service, surgery, answer)
    one = measured(service, single, send(service, single, calibration, PAIRS[:1]))
    burst = burst_of(service, surgery)
    assert [triad["label"] for triad in result["triads"]] == ["L1", "T11", "T9", "T7"]
    assert [pair["offset_s"] for pair in burst["pairs"]] == [0, 1, 2, 3, 4, 5]
    assert burst["pairs"][3]["view_delay_s"] == 0.002
    assert burst["pairs_used"] == {"L1": 6, "T11": 6, "T9": 6, "T7": 6}
    for before, triad in zip(one["triads"], result["triads"], strict=True):
        poses = [pair["poses"][triad["label"]]["position_mm"] for pair in burst["pairs"]]
        assert triad["position_mm"] == pytest.approx(np.mean(poses, axis=0), abs=1e-6)
        assert burst["pairs"][0]["poses"][triad["label"]]["position_mm"] == before["position_mm"]
        assert triad["balls"] == before["balls"]
        assert triad["position_sd_mm"] < before["position_sd_mm"]
    assert burst_of(service, single) is None
    image = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/right", params={"pair": 4})
    assert image.content == PAIRS[3][1]
    beyond = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/right", params={"pair": 7})
    assert code_of(beyond, 404) == "pair-not-found"
    codes = {flag["code"] for flag in result["flags"]}
    assert not codes & {"views-not-synchronous", "burst-outlier", "burst-incomplete", "exposure-unequal"}


def test_a_pair_whose_views_were_not_exposed_together_is_flagged(
    service: Service, surgery: str, calibration: str
) -> None:
    fields: dict[str, Any] = {"left_exposed_at": times(1), "right_exposed_at": times(1, late_s=-0.25)}
    result = measured(service, surgery, send(service, surgery, calibration, PAIRS[:1], **fields))
    (detail,) = [f["detail"] for f in result["flags"] if f["code"] == "views-not-synchronous"]
    assert "the left view was exposed 250 ms after the other one" in detail
    assert "2 mm at 15 a minute" in detail


BAD: dict[str, tuple[list[Pair], dict[str, Any], str, list[Any]]] = {
    "the same image twice": ([PAIRS[0], (PAIRS[0][0], PAIRS[1][1])], {}, "same-image-twice", ["left", 1]),
    "left as right": ([PAIRS[0], (PAIRS[1][0], PAIRS[0][0])], {}, "same-image-twice", ["right", 1]),
    "too many": (PAIRS[:1] * 61, {}, "burst-too-long", ["left"]),
    "mixed sizes": ([PAIRS[0], (PAIRS[1][0], b"")], {}, "image-size-mismatch", ["right", 1]),
    "times of one view": (PAIRS[:2], {"left_exposed_at": times(2)}, "burst-unequal", ["right_exposed_at"]),
    "a time too few": (
        PAIRS[:2],
        {"left_exposed_at": times(2), "right_exposed_at": times(1)},
        "burst-unequal",
        ["right_exposed_at"],
    ),
    "times out of order": (
        PAIRS[:2],
        {"left_exposed_at": times(2)[::-1], "right_exposed_at": times(2)[::-1]},
        "time-implausible",
        ["left_exposed_at", 1],
    ),
    "a time to come": (
        PAIRS[:1],
        {"left_exposed_at": ["2999-01-01T00:00:00Z"], "right_exposed_at": ["2999-01-01T00:00:00Z"]},
        "time-implausible",
        ["left_exposed_at"],
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_burst_is_refused_by_name_and_nothing_is_stored(
    service: Service, surgery: str, calibration: str, case: str, board_image: bytes
) -> None:
    pairs, fields, code, loc = BAD[case]
    pairs = [(left, right or board_image) for left, right in pairs]
    before = service.sql(STORED)
    answer = send(service, surgery, calibration, pairs, **fields)
    assert code_of(answer, 422) == code
    assert problem_of(answer, 422)["errors"][0]["loc"] == ["body", *loc]
    assert service.sql(STORED) == before


def test_unequal_numbers_of_images_are_refused(service: Service, surgery: str, calibration: str) -> None:
    files = [("left", ("l", PAIRS[0][0])), ("left", ("l", PAIRS[1][0])), ("right", ("r", PAIRS[0][1]))]
    data = {"name": "PRE", "calibration_id": calibration}
    answer = service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files)
    assert code_of(answer, 422) == "burst-unequal"


@pytest.fixture(scope="module")
def board_image() -> bytes:
    """An image of another size than the cameras'."""
    import io  # noqa: PLC0415

    from PIL import Image  # noqa: PLC0415

    out = io.BytesIO()
    Image.fromarray(np.zeros((300, 400), np.uint8)).save(out, "PNG")
    return out.getvalue()


def test_a_triad_missing_in_some_pairs_is_the_mean_of_the_others(
    service: Service, surgery: str, calibration: str
) -> None:
    pairs = [with_noise(sample("INTER"), seed) for seed in range(3)]
    pairs[1] = without(pairs[1], T7_IN_INTER)
    answer = send(
        service, surgery, calibration, pairs, "INTER", left_exposed_at=times(3), right_exposed_at=times(3)
    )
    result = measured(service, surgery, answer)
    burst = burst_of(service, surgery, "INTER")
    assert burst["pairs_used"] == {"L1": 3, "T11": 3, "T9": 3, "T7": 2}
    assert burst["pairs"][1]["labelled_by"] == {"stage": "INTER", "take": 1, "pair": 1}
    assert result["labelled_by"] is None
    assert [triad["label"] for triad in result["triads"]] == ["L1", "T11", "T9", "T7"]
    assert "burst-incomplete" in {flag["code"] for flag in result["flags"]}


def submitted(service: Service, calibration: str) -> tuple[str, str, str]:
    """Submit PRE, and INTER with T7 hidden, to a service without workers; return the surgery and both jobs."""
    surgery = service.surgery()
    pre = send(service, surgery, calibration, [sample("PRE")], "PRE")
    inter = send(service, surgery, calibration, [without(sample("INTER"), T7_IN_INTER)], "INTER")
    return surgery, pre.json()["job"]["id"], inter.json()["job"]["id"]


def enqueued(service: Service, *jobs: str) -> None:
    """Replace what waits in the queue."""
    queue = JobQueue(service.queue_url)
    queue.huey.flush()
    for job in jobs:
        queue.enqueue(job)
    queue.close()


def test_results_do_not_depend_on_the_order_of_jobs(tmp_path: Path) -> None:
    results = []
    with Service(tmp_path) as service:
        calibration = service.calibration()
        for order in ((0, 1), (1, 0)):
            surgery, *jobs = submitted(service, calibration)
            enqueued(service, *(jobs[k] for k in order))
            service.start("worker")
            assert [service.finished(job)["state"] for job in jobs] == ["succeeded"] * 2
            assert [service.job(job)["attempts"] for job in jobs] == [1, 1]
            service.kill_workers()
            triads = service.client.get(f"/v1/surgeries/{surgery}/stages/INTER/triads").json()
            results.append((triads["triads"], triads["flags"], triads["labelled_by"]))
    assert results[0] == results[1]
    assert [triad["label"] for triad in results[0][0]] == ["L1", "T11", "T9"]
    assert results[0][2] == {"stage": "PRE", "take": 1, "pair": None}


def test_an_earlier_stage_that_is_cancelled_is_not_waited_for(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        surgery, pre, inter = submitted(service, service.calibration())
        enqueued(service, inter)
        assert service.client.post(f"/v1/jobs/{pre}/cancel").status_code == 200
        service.start("worker")
        wait_for(lambda: service.job(inter)["state"] in {"succeeded", "failed"}, "the stage to be measured")
        triads = service.client.get(f"/v1/surgeries/{surgery}/stages/INTER/triads").json()
    assert triads["labelled_by"] is None
    assert {triad["label"] for triad in triads["triads"]} == {None}
