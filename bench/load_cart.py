"""A cart: sends stages of a surgery, repeats what was not answered, and waits for results."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from uuid import uuid4

import httpx

from bench.load_pairs import Pair, rig_text, spine_document, surgery_document
from bench.load_service import LoadService, ServiceStuckError

_FINAL = frozenset({"succeeded", "failed", "cancelled"})
_WAIT_S = 5
_POLL_S = 0.02
_RETRY_S = 0.05
_PATIENCE_S = 300.0

Document = dict[str, Any]


@dataclass
class Cart:
    """A client of the service with a surgery of its own.

    Attributes
    ----------
    client
        HTTP client.
    long_poll
        Whether to wait for jobs in the request; otherwise the job is asked for again and again.
    insistent
        Whether to repeat a request that failed, as during kills; otherwise errors are raised.
    statuses
        Number of answers by status.
    """

    client: httpx.Client
    long_poll: bool
    insistent: bool = False
    statuses: Counter[int] = field(default_factory=Counter)
    calibration: str = ""
    surgery: str = ""

    @classmethod
    def of(cls, service: LoadService, *, insistent: bool = False) -> Cart:
        """Return a cart with a client of its own; the caller closes it."""
        return cls(service.client(), service.long_poll, insistent)

    def open_surgery(self, *, spine: bool = False) -> None:
        """Store the rig and a surgery, with a setup of the spine or without."""
        header = {"Content-Type": "application/json"}
        answer = self.request("POST", "/v1/calibrations", content=rig_text(), headers=header)
        self.calibration = _expect(answer, 201)["id"]
        document = surgery_document(f"test-{uuid4().int % 10**12}")
        self.surgery = _expect(self.request("POST", "/v1/surgeries", json=document), 201)["id"]
        if spine:
            answer = self.request("PUT", f"/v1/surgeries/{self.surgery}/spine", json=spine_document())
            _expect(answer, 200, 201)

    def submit(self, name: str, pair: Pair) -> str:
        """Send a stage; return its job, also where an answer was lost and the stage is there already."""
        key = str(uuid4())
        answer = self.request(
            "POST",
            f"/v1/surgeries/{self.surgery}/stages",
            data={"name": name, "calibration_id": self.calibration},
            files={"left": ("left.png", pair.left), "right": ("right.png", pair.right)},
            headers={"Idempotency-Key": key},
        )
        if self.insistent and answer.status_code == httpx.codes.CONFLICT:
            answer = self.request("GET", f"/v1/surgeries/{self.surgery}/stages/{name}")
        job: str = _expect(answer, 200, 202)["job"]["id"]
        return job

    def ended(self, job: str) -> Document:
        """Return a job when it has ended."""
        path = f"/v1/jobs/{job}?wait={_WAIT_S}" if self.long_poll else f"/v1/jobs/{job}"
        end = time.monotonic() + _PATIENCE_S
        while time.monotonic() < end:
            document = _expect(self.request("GET", path), 200)
            if document["state"] in _FINAL:
                return document
            if not self.long_poll:
                time.sleep(_POLL_S)
        raise ServiceStuckError(f"job {job} is {document['state']} after {_PATIENCE_S:.0f} s")

    def result(self, name: str) -> Document:
        """Return what was measured: features, triads, flags and parameters, without identifiers."""
        stage = f"/v1/surgeries/{self.surgery}/stages/{name}"
        documents = [_expect(self.request("GET", f"{stage}/{part}"), 200) for part in ("features", "triads")]
        for document in documents:
            document.pop("surgery_id")
        return {"features": documents[0], "triads": documents[1]}

    def request(self, method: str, path: str, **options: Any) -> httpx.Response:
        """Send a request; an insistent cart repeats it until the service answers it."""
        end = time.monotonic() + _PATIENCE_S
        while True:
            try:
                answer = self.client.request(method, path, **options)
            except httpx.TransportError:
                if not self.insistent or time.monotonic() > end:
                    raise
            else:
                self.statuses[answer.status_code] += 1
                if not (self.insistent and answer.is_server_error) or time.monotonic() > end:
                    return answer
            time.sleep(_RETRY_S)

    def close(self) -> None:
        """Close the client."""
        self.client.close()


def milliseconds(call: Callable[[], object]) -> float:
    """Return how long a call takes."""
    start = time.perf_counter()
    call()
    return (time.perf_counter() - start) * 1e3


def _expect(answer: httpx.Response, *statuses: int) -> Document:
    if answer.status_code not in statuses:
        raise ServiceStuckError(
            f"{answer.request.method} {answer.request.url.path}: {answer.status_code} {answer.text[:500]}"
        )
    document: Document = answer.json()
    return document
