"""Slips that only a record of stages can see, asked of a running service: times, stale frames, surgeries, rigs."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import cached_property
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import httpx
import numpy as np
from PIL import Image

from bench.slips.slip import Answer, Kind, Outcome, Right, Slip
from bench.slips.sound import RigJson, changed_rig, each_camera, rig, stage_files, tiny_baseline
from tests.http.harness import Service

Pair = tuple[bytes, bytes]
_SPINE_SECONDS = 60.0
"""Longest wait for the spine of a stage."""

_SURGERY = {
    "reference": "case 1",
    "vertebrae": ["L1", "T11", "T9", "T7"],
    "reference_vertebra": "L1",
    "spine_axis": "x",
}


class SlipService:
    """A running service with one worker, and the few calls that slips make."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self.client: httpx.Client = service.client

    @cached_property
    def calibration(self) -> str:
        """Identifier of the sample's calibration, made now."""
        return self._service.calibration()

    def surgery(self, **fields: Any) -> str:
        """Return the identifier of a new surgery."""
        answer = self.client.post("/v1/surgeries", json={**_SURGERY, **fields})
        answer.raise_for_status()
        return str(answer.json()["id"])

    def stage(
        self,
        surgery: str,
        name: str,
        images: Pair,
        captured_at: str | None = None,
        calibration: str | None = None,
    ) -> Answer:
        """Send a stage, wait for it, and return its flags and triads, or the refusal."""
        start = perf_counter()
        sent = self._service.send(surgery, name, images, calibration or self.calibration, captured_at)
        return self.measured(surgery, name, sent) if sent.is_success else answer_of(sent, start)

    def measured(self, surgery: str, name: str, sent: httpx.Response) -> Answer:
        """Wait for a stage that was sent or revised, and return its flags and triads, or why it failed."""
        start = perf_counter()
        job = self._service.finished(sent.headers["location"].removeprefix("/v1/jobs/"))
        if job["state"] != "succeeded":
            return Answer(
                2 if job["attempts"] == 1 else None, json.dumps(job["error"]), {}, perf_counter() - start
            )
        stage = self.client.get(f"/v1/surgeries/{surgery}/stages/{name}").json()
        triads = self.client.get(f"/v1/surgeries/{surgery}/stages/{name}/triads").json()["triads"]
        return Answer(0, "", {"flags": stage["flags"], "triads": triads}, perf_counter() - start)

    def edit(self, surgery: str, name: str, edits: Mapping[str, Any]) -> Answer:
        """Revise a stage, wait for it, and return the refusal, or a result without flags."""
        start = perf_counter()
        sent = self.client.post(f"/v1/surgeries/{surgery}/stages/{name}/revisions", json=edits)
        if sent.is_success:
            self._service.finished(sent.json()["job"]["id"])
        return answer_of(sent, start)

    def spine(self, surgery: str, name: str, setup: Mapping[str, Any]) -> Answer:
        """Store the setup of a spine, wait for the spine of a stage, and return it, or the refusal."""
        start = perf_counter()
        sent = self.client.put(f"/v1/surgeries/{surgery}/spine", json=setup)
        if not sent.is_success:
            return answer_of(sent, start)
        got = sent
        while perf_counter() - start < _SPINE_SECONDS:
            got = self.client.get(f"/v1/surgeries/{surgery}/stages/{name}/spine")
            if got.is_success or "spine-not-ready" not in got.text:
                break
            sleep(0.2)
        return Answer(0, "", got.json(), perf_counter() - start) if got.is_success else answer_of(got, start)

    def motion(self, surgery: str, first: str, second: str, stage: Answer) -> Answer:
        """Return the motion between two stages with the flags of the second and its own."""
        got = self.client.get(f"/v1/surgeries/{surgery}/motion", params={"from": first, "to": second})
        if not got.is_success:
            return stage
        document = got.json()
        flags = [*stage.document["flags"], *document.get("flags", ())]
        return Answer(0, "", {**stage.document, **document, "flags": flags}, stage.seconds)


@contextmanager
def running(folder: Path) -> Iterator[SlipService]:
    """Run a service and one worker with its record in a folder."""
    with Service(folder) as service:
        service.start("worker")
        yield SlipService(service)


def ask_slip(slip: Slip, service: SlipService, folder: Path) -> Outcome:
    """Ask the service, and return the outcome."""
    if slip.ask is None:
        raise ValueError(f"{slip.name!r} is for the command line")
    return Outcome(slip, slip.ask(service, folder))


def answer_of(response: httpx.Response, start: float) -> Answer:
    """Return a response as an answer: 4xx a refusal, 5xx a crash, 2xx a result with its flags."""
    seconds = perf_counter() - start
    if response.is_server_error:
        return Answer(None, response.text, {}, seconds)
    document = response.json()
    if response.is_client_error:
        text = " ".join(str(document.get(key, "")) for key in ("type", "title", "detail", "errors"))
        return Answer(2, text, {}, seconds)
    return Answer(0, response.text[:300], {"flags": document.get("flags", [])}, seconds)


def slips() -> Iterator[Slip]:
    """Yield the slips that a service is asked for."""
    yield from _stale()
    yield from _times()
    yield from _surgeries()
    yield from _rigs()
    yield from _series()


def _stale() -> Iterator[Slip]:
    repeated = Right(refusal=r"same|repeated|already", flags=("frame-repeated", "no-triads"))
    cases: tuple[tuple[str, str, Callable[[Pair], Pair]], ...] = (
        ("the same files as a new stage", "PRE", lambda images: images),
        ("the same images in other files", "INTER", lambda images: _recoded(images, 0.0)),
        ("the same images but for noise", "POST", lambda images: _recoded(images, 1.0)),
        ("the left image of the stage before", "PRE", lambda images: (images[0], pair_of("INTER")[1])),
        ("the same images, a little brighter", "INTER", lambda images: _recoded(images, 0.0, 1.05)),
    )
    for name, stage, change in cases:
        yield _ask(name, "stale", stage, repeated, _stale_stage(stage, change))


def _times() -> Iterator[Slip]:
    refused = Right(refusal=r"captured_at|future|before|past|1970|time", flags=("time-implausible",))
    now = datetime.now(UTC)
    cases = (
        ("captured in 1970", "1970-01-01T00:00:00Z"),
        ("captured in 2099", "2099-06-01T10:00:00Z"),
        ("captured tomorrow", (now + timedelta(days=1)).isoformat(timespec="seconds")),
        ("captured a day before its calibration", (now - timedelta(days=1)).isoformat(timespec="seconds")),
    )
    for name, captured_at in cases:
        yield _ask(name, "time", "PRE", refused, _captured(captured_at))
    digits = Right(sound=lambda answer: len(answer.document.get("triads", ())) == 4)
    seven = now.strftime("%Y-%m-%dT%H:%M:%S.1234567Z")
    yield _ask("captured_at with seven decimals", "time", "POST", digits, _captured(seven))
    later = Right(refusal=r"calibrated_at|future|time", flags=("time-implausible",))
    for name, when in (("2099", "2099-01-01T00:00:00Z"), ("1970", "1970-01-01T00:00:00Z")):
        yield _ask(f"calibrated in {name}", "time", "D1 rig", later, _calibrated(when))
    order = Right(refusal=r"captured_at|before|order", flags=("time-implausible",))
    yield _ask("a later stage captured before the earlier one", "time", "INTER", order, _out_of_order)


def _surgeries() -> Iterator[Slip]:
    sequence = Right(refusal=r"order|sequence|monoton")
    cases: tuple[tuple[str, Kind, list[str], Right], ...] = (
        ("a surgery with shuffled vertebrae", "order", ["L1", "T9", "T11", "T7"], sequence),
        ("a surgery with L9", "labels", ["L9", "T11", "T9", "T7"], Right(refusal=r"L9")),
        ("a surgery with T77", "labels", ["L1", "T11", "T9", "T77"], Right(refusal=r"T77")),
        (
            "a surgery with a vertebra in two spellings",
            "labels",
            ["L1", "l1", "T9", "T7"],
            Right(refusal=r"twice|same|pattern"),
        ),
        (
            "a surgery with a leading zero",
            "labels",
            ["L1", "L01", "T9", "T7"],
            Right(refusal=r"twice|same|pattern|L01"),
        ),
    )
    for name, kind, vertebrae, right in cases:
        yield _ask(name, kind, "-", right, _new_surgery(vertebrae))
    given = Right(refusal=r"order|exchang", flags=("levels-implausible",))
    for name, labels in (
        ("labels of neighbours exchanged by hand", {1: "T9", 2: "T11"}),
        ("all labels reversed by hand", {0: "T7", 1: "T9", 2: "T11", 3: "L1"}),
    ):
        yield _ask(name, "order", "PRE", given, _edited_labels(labels))
    many = Right(flags=("triad-count-high",), labels_null=True)
    yield _ask("a surgery that names two of four triads", "labels", "PRE", many, _two_of_four)


def _rigs() -> Iterator[Slip]:
    cases: tuple[tuple[str, Callable[[RigJson], object], str], ...] = (
        (
            "stored rig looks away",
            each_camera("rotation_deg", lambda a: [a[0] + 180, *a[1:]]),
            r"rotation_deg|look",
        ),
        (
            "stored rig has pixels of 10 mm",
            each_camera("pixel_size_mm", lambda _: [10.0, 8.45]),
            r"pixel_size_mm",
        ),
        (
            "stored rig has a focal length of 1e12",
            each_camera("focal_length_mm", lambda _: 1e12),
            r"focal_length_mm",
        ),
        ("stored rig has a baseline of 1e-300", tiny_baseline, r"position_mm|baseline"),
        (
            "stored rig in metres",
            each_camera("position_mm", lambda p: [v / 1000 for v in p]),
            r"position_mm|baseline|metre",
        ),
        (
            "stored rig has an integer of 400 digits",
            lambda r: r["left"].update(focal_length_mm=10**400),
            r"focal_length_mm|finite|large|number",
        ),
    )
    for name, change, pattern in cases:
        yield _ask(name, "rig", "D1 rig", Right(refusal=pattern), _new_rig(changed_rig(change)))


def _series() -> Iterator[Slip]:
    """Yield slips that the stages of a surgery show together."""
    lens = Right(flags=("lens-differs",))

    def sign(document: RigJson) -> None:
        each_camera("radial", lambda radial: [-radial[0], *radial[1:]])(document)

    def rows(document: RigJson) -> None:
        each_camera("pixel_size_mm", lambda size: [size[0], 1.01 * size[1]])(document)

    yield _ask(
        "the rig of one stage with K1 of the other sign", "rig", "INTER", lens, _rig_of_one_stage(sign)
    )
    yield _ask("the rig of one stage with rows 1% apart", "rig", "INTER", lens, _rig_of_one_stage(rows))
    scale = Right(flags=("calibration-drift",))
    yield _ask("a base 0.4% too long in all stages", "rig", "PRE to POST", scale, _base_of_all_stages)


def _ask(name: str, kind: Kind, pair: str, right: Right, ask: Callable[[SlipService, Path], Answer]) -> Slip:
    return Slip(name, kind, pair, "service", right, ask=ask)


def pair_of(stage: str) -> Pair:
    """Return the images of a sample stage."""
    left, right = stage_files(stage)
    return left.read_bytes(), right.read_bytes()


def _recoded(images: Pair, noise: float, gain: float = 1.0) -> Pair:
    rng = np.random.default_rng(17)

    def change(content: bytes) -> bytes:
        gray = gain * np.array(Image.open(io.BytesIO(content)).convert("L")).astype(np.float64)
        noisy = np.clip(np.rint(gray + noise * rng.standard_normal(gray.shape)), 0, 255).astype(np.uint8)
        out = io.BytesIO()
        Image.fromarray(noisy).save(out, "TIFF")
        return out.getvalue()

    return change(images[0]), change(images[1])


def _stale_stage(stage: str, change: Callable[[Pair], Pair]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        service.stage(surgery, "A", pair_of(stage))
        return service.motion(surgery, "A", "B", service.stage(surgery, "B", change(pair_of(stage))))

    return ask


def _captured(captured_at: str) -> Callable[[SlipService, Path], Answer]:
    return lambda service, _: service.stage(service.surgery(), "A", pair_of("PRE"), captured_at)


def _out_of_order(service: SlipService, _: Path) -> Answer:
    surgery, now = service.surgery(), datetime.now(UTC)
    service.stage(surgery, "PRE", pair_of("PRE"), now.isoformat(timespec="seconds"))
    before = (now - timedelta(minutes=40)).isoformat(timespec="seconds")
    return service.stage(surgery, "INTER", pair_of("INTER"), before)


def _calibrated(when: str) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        start = perf_counter()
        posted = service.client.post("/v1/calibrations", params={"calibrated_at": when}, json=rig())
        if not posted.is_success:
            return answer_of(posted, start)
        return service.stage(service.surgery(), "A", pair_of("PRE"), calibration=posted.json()["id"])

    return ask


def _new_surgery(vertebrae: Sequence[str]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        body = {**_SURGERY, "vertebrae": vertebrae, "reference_vertebra": vertebrae[0]}
        return answer_of(service.client.post("/v1/surgeries", json=body), perf_counter())

    return ask


def _edited_labels(labels: Mapping[int, str]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        service.stage(surgery, "PRE", pair_of("PRE"))
        last = service.stage(surgery, "POST", pair_of("POST"))
        edits = [{"triad": triad, "label": label} for triad, label in labels.items()]
        edited = service.edit(surgery, "PRE", {"kind": "edit", "take": 1, "labels": edits})
        return edited if edited.status else service.motion(surgery, "PRE", "POST", last)

    return ask


def _two_of_four(service: SlipService, _: Path) -> Answer:
    surgery = service.surgery(vertebrae=["L1", "T9"])
    service.stage(surgery, "PRE", pair_of("PRE"))
    return service.motion(surgery, "PRE", "POST", service.stage(surgery, "POST", pair_of("POST")))


def _rig_of_one_stage(change: Callable[[RigJson], object]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        other = service.client.post("/v1/calibrations", json=changed_rig(change)).json()["id"]
        surgery = service.surgery()
        service.stage(surgery, "PRE", pair_of("PRE"))
        return service.stage(surgery, "INTER", pair_of("INTER"), calibration=other)

    return ask


def _base_of_all_stages(service: SlipService, _: Path) -> Answer:
    def longer(document: RigJson) -> None:
        left, right = (np.array(document[side]["position_mm"]) for side in ("left", "right"))
        document["right"]["position_mm"] = (right + 0.004 * (right - left)).tolist()

    calibration = service.client.post("/v1/calibrations", json=changed_rig(longer)).json()["id"]
    surgery = service.surgery()
    service.stage(surgery, "PRE", pair_of("PRE"), calibration=calibration)
    return service.stage(surgery, "INTER", pair_of("INTER"), calibration=calibration)


def _new_rig(document: RigJson) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        headers = {"Content-Type": "application/json"}
        content = json.dumps(document)
        return answer_of(
            service.client.post("/v1/calibrations", content=content, headers=headers), perf_counter()
        )

    return ask
