"""The motion of 1995 beside the motion of today."""

import pytest

from tests.http.harness import VERTEBRAE, Service, code_of


def test_the_table_of_1995_agrees_with_the_triads_and_with_the_angle_between_the_normals(
    service: Service, measured: str
) -> None:
    path = f"/v1/surgeries/{measured}/motion"
    legacy = service.client.get(f"{path}/legacy-1995?from=PRE&to=POST").json()
    today = service.client.get(f"{path}?from=PRE&to=POST").json()
    triads = service.client.get(f"/v1/surgeries/{measured}/stages/PRE/triads").json()["triads"]
    positions = {triad["label"]: triad["position_mm"] for triad in triads}
    assert legacy["method"] == "legacy_1995"
    assert [row["vertebra"] for row in legacy["before"]["rows"]] == VERTEBRAE
    for row, triad in zip(legacy["before"]["rows"], triads, strict=True):
        offset = [a - b for a, b in zip(triad["position_mm"], positions["L1"], strict=True)]
        assert row["position_mm"] == pytest.approx(offset)
        assert row["angles_deg"] == pytest.approx(triad["angles_deg"])
    assert {motion["vertebra"] for motion in today["vertebrae"]} == set(VERTEBRAE) - {"L1"}
    # the cart turns between the stages, which object axes show as a motion of every triad, L1 included
    assert next(m["angle_deg"] for m in legacy["motion"] if m["vertebra"] == "L1") > 0.5


def test_a_stage_that_does_not_exist_is_named(service: Service, measured: str) -> None:
    answer = service.client.get(f"/v1/surgeries/{measured}/motion/legacy-1995?from=PRE&to=NONE")
    assert code_of(answer, 404) == "stage-not-found"
