"""A capture cart: submits calibrations, surgeries and stages to the service and asks for results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from spinewatch.errors import SpinewatchError

_SIDES = ("left", "right")
_REQUEST_SECONDS = 30.0

Document = dict[str, Any]


class ServiceError(SpinewatchError):
    """The service refused a request, cannot be reached, or does not finish its work."""

    code = "service"


@dataclass(frozen=True)
class Submitted:
    """A stage that was accepted, with the path of its job."""

    name: str
    job_path: str


class ApiClient:
    """Talks to one service; use as a context manager."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._client = httpx.Client(base_url=self.url, timeout=_REQUEST_SECONDS, trust_env=False)

    def __enter__(self) -> ApiClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    def ready(self) -> bool:
        """Return whether the service answers that it is healthy."""
        try:
            return self._client.get("/v1/health", timeout=1.0).is_success
        except httpx.HTTPError:
            return False

    def submit_calibration(self, rig_json: bytes) -> str:
        """Store a rig and return the calibration's id."""
        headers = {"Content-Type": "application/json"}
        return str(self._ask("POST", "/v1/calibrations", content=rig_json, headers=headers).json()["id"])

    def open_surgery(self, surgery: Document) -> str:
        """Open a surgery and return its id."""
        return str(self._ask("POST", "/v1/surgeries", json=surgery).json()["id"])

    def submit_stage(self, surgery_id: str, name: str, calibration_id: str, folder: Path) -> Submitted:
        """Upload the pair ``left.png`` and ``right.png`` of a folder as a stage."""
        files = {side: (f"{side}.png", (folder / f"{side}.png").read_bytes(), "image/png") for side in _SIDES}
        fields = {"name": name, "calibration_id": calibration_id}
        answer = self._ask("POST", f"/v1/surgeries/{surgery_id}/stages", data=fields, files=files)
        return Submitted(name, answer.headers["Location"])

    def get(self, path: str) -> Document:
        """Return the document at a path."""
        document: Document = self._ask("GET", path).json()
        return document

    def _ask(self, method: str, path: str, **content: Any) -> httpx.Response:
        try:
            answer = self._client.request(method, path, **content)
        except httpx.HTTPError as error:
            raise ServiceError(f"no answer from {self.url}: {error}; is the service running?") from error
        if answer.is_success:
            return answer
        raise ServiceError(f"{method} {path}: {_problem(answer)}")


def _problem(answer: httpx.Response) -> str:
    if answer.headers.get("Content-Type", "").startswith("application/problem+json"):
        problem = answer.json()
        return f"{answer.status_code} {problem.get('detail') or problem.get('title')}"
    return f"{answer.status_code} {answer.reason_phrase}"
