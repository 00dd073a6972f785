"""Ball centres that a person adds, moves or removes: the pair is matched again, and decisions before are kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import httpx
import numpy as np
import pytest

from tests.http.harness import Service, code_of, pair
from tests.stage_images import Box, Pair, sample, with_noise, without

NOTHING: Box = (0, 0, 0, 0)


class Case:
    """A surgery with a measured stage PRE."""

    def __init__(self, service: Service, calibration: str, pairs: Sequence[Pair]) -> None:
        self.service, self.surgery = service, service.surgery()
        self.path = f"/v1/surgeries/{self.surgery}/stages/PRE"
        files = [(side, (side, one[k])) for k, side in enumerate(("left", "right")) for one in pairs]
        data = {"name": "PRE", "calibration_id": calibration}
        answer = service.client.post(f"/v1/surgeries/{self.surgery}/stages", data=data, files=files)
        assert self.ended(answer) == "succeeded"

    def ended(self, answer: httpx.Response) -> str:
        assert answer.status_code == 202, answer.text
        return str(self.service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))["state"])

    def get(self, part: str, **parameters: Any) -> dict[str, Any]:
        answer = self.service.client.get(f"{self.path}/{part}", params=parameters)
        assert answer.status_code == 200, answer.text
        document: dict[str, Any] = answer.json()
        return document

    def revise(self, **edits: Any) -> httpx.Response:
        take = self.get("triads")["take"]
        return self.service.client.post(
            f"{self.path}/revisions", json={"kind": "edit", "take": take, **edits}
        )

    def revised(self, **edits: Any) -> dict[str, Any]:
        assert self.ended(self.revise(**edits)) == "succeeded"
        return self.get("triads")

    def feature(self, side: str, centre: Sequence[float], **parameters: Any) -> int:
        """Return the place of the feature at a centre."""
        features = self.get("features", **parameters)["features"][side]
        return next(k for k, feature in enumerate(features) if [feature["x"], feature["y"]] == list(centre))


@pytest.fixture
def case(service: Service, calibration: str) -> Case:
    return Case(service, calibration, [pair("PRE")])


def by_label(document: dict[str, Any], label: str) -> dict[str, Any]:
    return next(triad for triad in document["triads"] if triad["label"] == label)


def codes(document: dict[str, Any]) -> list[str]:
    return [flag["code"] for flag in document["flags"]]


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_centre_is_moved_in_either_image(case: Case, side: str) -> None:
    before = case.get("triads")
    x, y = by_label(before, "T9")["balls"]["XX"][side]
    place = case.feature(side, (x, y))
    moved = {"action": "move", "side": side, "feature": place, "x": x + 1.5, "y": y}
    answer = case.revise(centres=[moved])
    assert case.ended(answer) == "succeeded"
    after = case.get("triads")
    ball = by_label(after, "T9")["balls"]["XX"]
    assert (ball[side], ball["manual"]) == ([x + 1.5, y], [side])
    assert by_label(after, "T9")["position_mm"] != by_label(before, "T9")["position_mm"]
    for name, untouched in by_label(before, "L1")["balls"].items():  # equal but for the order of sums
        now = by_label(after, "L1")["balls"][name]
        assert now["sd_mm"] == pytest.approx(untouched["sd_mm"], rel=1e-12)
        assert {**now, "sd_mm": None} == {**untouched, "sd_mm": None}
    assert "ball-manual" in codes(after)
    assert "ball-manual" not in codes(before)
    placed = [feature for feature in case.get("features")["features"][side] if feature["manual"]]
    assert [(feature["x"], feature["y"], feature["score"]) for feature in placed] == [(x + 1.5, y, 1)]
    assert after["revision"]["changes"]["centres"] == [{**moved, "pair": 1}]
    assert after["revision"]["by"].endswith("test")
    assert case.get("triads", take=1) == before
    assert "http:stage:revised" in case.service.events(answer.json()["id"])


def test_a_hidden_ball_is_added_where_it_was_painted_over(service: Service, calibration: str) -> None:
    sound = by_label(Case(service, calibration, [pair("PRE")]).get("triads"), "T9")
    u, v = sound["balls"]["YY"]["left"]
    around = (round(u) - 6, round(v) - 7, round(u) + 7, round(v) + 8)
    case = Case(service, calibration, [without(sample("PRE"), (around, NOTHING))])
    before = case.get("triads")
    assert "ball-occluded" in codes(before)
    after = case.revised(centres=[{"action": "add", "side": "left", "x": u, "y": v}])
    triad = by_label(after, "T9")
    assert triad["balls"]["YY"]["manual"] == ["left"]
    assert triad["position_mm"] == pytest.approx(sound["position_mm"], abs=0.5)
    assert max(triad["rotation_sd_deg"]) < max(by_label(before, "T9")["rotation_sd_deg"])
    assert "ball-occluded" not in codes(after)


def test_centres_of_a_triad_that_are_displaced_together_are_flagged_with_their_distance(case: Case) -> None:
    before = by_label(case.get("triads"), "T9")
    moves = [
        {"action": "move", "side": "left", "feature": case.feature("left", (x, y)), "x": x + 8, "y": y}
        for x, y in (ball["left"] for ball in before["balls"].values())
    ]
    after = case.revised(centres=moves)
    assert "centre-displaced" in codes(after)
    triad = by_label(after, "T9")
    for name, ball in triad["balls"].items():
        (placed,) = ball["placed"]
        assert (placed["side"], placed["feature"]) == ("left", before["balls"][name]["left"])
        assert placed["distance_px"] == pytest.approx(8)
        assert placed["distance_sd"] > 10
    moved = np.subtract(triad["position_mm"], before["position_mm"])
    assert (np.abs(moved) < 3 * np.array(triad["position_sd_mm"])).all()
    again = case.revised(labels=[{"triad": 0, "label": after["triads"][0]["label"]}])
    assert by_label(again, "T9")["balls"] == triad["balls"]


def test_a_false_centre_is_removed(case: Case) -> None:
    before = case.get("triads")
    x, y = by_label(before, "T9")["balls"]["YY"]["left"]
    place = case.feature("left", (x, y))
    after = case.revised(centres=[{"action": "remove", "side": "left", "feature": place}])
    assert [x, y] not in [ball["left"] for triad in after["triads"] for ball in triad["balls"].values()]
    counts = [len(case.get("features", take=take)["features"]["left"]) for take in (1, 2)]
    assert counts == [150, 149]
    assert by_label(after, "T7")["position_mm"] == pytest.approx(by_label(before, "T7")["position_mm"])


@pytest.mark.parametrize(
    ("edit", "code"),
    [
        ({"action": "add", "side": "left", "x": 768.0, "y": 100.0}, "centre-outside-image"),
        ({"action": "move", "side": "right", "feature": 0, "x": 10.0, "y": -200.0}, "centre-outside-image"),
        ({"action": "move", "side": "left", "feature": 900, "x": 10.0, "y": 10.0}, "unknown-feature"),
        ({"action": "remove", "side": "right", "feature": 150}, "unknown-feature"),
        ({"action": "add", "pair": 2, "side": "left", "x": 10.0, "y": 10.0}, "unknown-pair"),
        ({"action": "add", "side": "middle", "x": 10.0, "y": 10.0}, "invalid-request"),
        ({"action": "add", "side": "left", "x": "ten", "y": 10.0}, "invalid-request"),
        ({"action": "draw", "side": "left"}, "invalid-request"),
    ],
)
def test_an_edit_that_does_not_fit_is_refused_with_its_place(
    service: Service, measured: str, edit: dict[str, Any], code: str
) -> None:
    sound = {"action": "add", "side": "left", "x": 10.0, "y": 10.0}
    answer = service.client.post(
        f"/v1/surgeries/{measured}/stages/PRE/revisions",
        json={"kind": "edit", "take": 1, "centres": [sound, edit]},
    )
    assert code_of(answer, 422) == code
    (error,) = answer.json()["errors"][:1]
    assert error["loc"][:3] == ["body", "centres", 1] or code == "invalid-request"


def test_decisions_stay_when_centres_are_edited_later(case: Case) -> None:
    first = case.revised(labels=[{"triad": 1, "label": None}, {"triad": 2, "label": "T11"}], removed=[3])
    assert [triad["label"] for triad in first["triads"]] == ["L1", "T11", None]
    assert [triad["label_manual"] for triad in first["triads"]] == [False, True, True]
    assert codes(first)[0] == "triad-count-low"
    x, y = by_label(first, "L1")["balls"]["MX"]["right"]
    place = case.feature("right", (x, y))
    after = case.revised(
        centres=[{"action": "move", "side": "right", "feature": place, "x": x, "y": y + 0.25}]
    )
    assert after["take"] == 3
    assert [triad["label"] for triad in after["triads"]] == ["L1", "T11", None]
    assert [triad["label_manual"] for triad in after["triads"]] == [False, True, True]
    assert by_label(after, "L1")["balls"]["MX"]["manual"] == ["right"]
    reasons = [triad["reason"] for triad in case.get("candidates")["explanation"]["triads"]]
    assert "removed" in reasons
    again = case.revised(labels=[{"triad": 2, "label": "T9"}])
    assert [triad["label"] for triad in again["triads"]] == ["L1", "T11", "T9"]
    assert by_label(again, "L1")["balls"]["MX"]["manual"] == ["right"]


def test_candidates_tell_what_was_chosen_and_what_rejected_the_others(case: Case) -> None:
    document = case.get("candidates")
    explanation, triads = document["explanation"], case.get("triads")["triads"]
    features = case.get("features")["features"]
    assert (document["stage"], document["take"], document["pair"]) == ("PRE", 1, 1)
    assert (explanation["method"], explanation["points_left_out"], explanation["triads_left_out"]) == (
        "default",
        0,
        0,
    )
    chosen = [triad for triad in explanation["triads"] if triad["reason"] is None]
    assert sorted(triad["triad"] for triad in chosen) == [0, 1, 2, 3]
    for candidate in chosen:
        shown = triads[candidate["triad"]]["balls"]
        for side in ("left", "right"):
            centres = [features[side][k] for k in candidate[side]]
            assert [[c["x"], c["y"]] for c in centres] == [shown[name][side] for name in candidate["balls"]]
    for side in ("left", "right"):
        uses = explanation[side]["features"]
        assert len(uses) == len(features[side])
        assert sum(use["candidate"] is not None for use in uses) == 12
        assert all((use["candidate"] is None) == (use["reason"] is not None) for use in uses)
        assert len(uses) + len(explanation[side]["discarded"]) == 250
    heuristics = {triad["reason"]: triad["heuristic"] for triad in explanation["triads"]}
    assert heuristics["feature-twice"] == "H1"
    assert heuristics["distances"] is None
    assert len(explanation["points"]) > 200


def test_candidates_of_a_pair_that_is_not_there_are_not_found(service: Service, measured: str) -> None:
    for part in ("candidates", "features", "images/left"):
        path = f"/v1/surgeries/{measured}/stages/PRE/{part}"
        assert service.client.get(path, params={"pair": "2"}).status_code == 404
        for number in ("0", "9" * 30):
            answer = service.client.get(path, params={"pair": number})
            assert code_of(answer, 422) == "invalid-request"


def test_a_burst_is_edited_by_label_by_triad_and_by_centre(service: Service, calibration: str) -> None:
    pairs = [with_noise(sample("PRE"), seed) for seed in range(3)]
    case = Case(service, calibration, pairs)
    before = case.get("triads")
    edited = case.revised(
        labels=[{"triad": 0, "label": "L1"}, {"triad": 2, "label": None}, {"triad": 1, "label": "T9"}],
        removed=[3],
    )
    assert [triad["label"] for triad in edited["triads"]] == ["L1", "T9", None]
    assert edited["triads"][1]["position_mm"] == pytest.approx(before["triads"][1]["position_mm"])
    burst = case.get("burst")["burst"]
    assert [sorted(one["poses"]) for one in burst["pairs"]] == [["L1", "T9"]] * 3
    assert burst["pairs_used"] == {"L1": 3, "T9": 3}
    explanation = case.get("candidates", pair=2)["explanation"]
    shown = case.get("features", pair=2)
    assert (shown["pair"], len(explanation["left"]["features"])) == (2, len(shown["features"]["left"]))
    first = next(triad for triad in explanation["triads"] if triad["triad"] == 0)
    place = first["left"][0]
    feature = shown["features"]["left"][place]
    move = {"action": "move", "pair": 2, "side": "left", "feature": place}
    after = case.revised(centres=[{**move, "x": feature["x"] + 0.5, "y": feature["y"]}])
    assert [triad["label"] for triad in after["triads"]] == ["L1", "T9", None]
    poses = [
        [one["poses"]["L1"]["position_mm"] for one in case.get("burst", take=take)["burst"]["pairs"]]
        for take in (2, 3)
    ]
    changed = [not np.allclose(a, b, atol=1e-9) for a, b in zip(*poses, strict=True)]
    assert changed == [False, True, False]
    assert any(
        flag["code"] == "ball-manual" and flag["detail"].startswith("pair 2") for flag in after["flags"]
    )


def test_exchanged_labels_are_flagged_in_the_stage_and_in_its_motion(
    service: Service, calibration: str, case: Case
) -> None:
    sent = service.send(case.surgery, "POST", pair("POST"), calibration)
    assert service.finished(sent.json()["job"]["id"])["state"] == "succeeded"
    edited = case.revised(labels=[{"triad": 1, "label": "T9"}, {"triad": 2, "label": "T11"}])
    assert [triad["label"] for triad in edited["triads"]] == ["L1", "T11", "T9", "T7"]
    assert codes(edited) == ["levels-implausible"]
    motion = service.client.get(
        f"/v1/surgeries/{case.surgery}/motion", params={"from": "PRE", "to": "POST"}
    ).json()
    assert ("PRE", "levels-implausible") in [(flag["stage"], flag["code"]) for flag in motion["flags"]]
    corrected = case.revised(labels=[{"triad": 1, "label": "T9"}, {"triad": 2, "label": "T11"}])
    assert codes(corrected) == []
