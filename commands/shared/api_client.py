"""Client of the HTTP API: submits calibrations, surgeries and stages, and reads results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from commands.shared.files import read_image
from spinewatch.errors import SpinewatchError

_SIDES = ("left", "right")
_TIMEOUT_SECONDS = 30.0

Document = dict[str, Any]


class ServiceError(SpinewatchError):
    """The service rejected a request, cannot be reached, or does not finish a job."""

    code = "service"


@dataclass(frozen=True)
class SubmittedStage:
    """A stage accepted by the service: its name and the path of its job."""

    name: str
    job_path: str


class ApiClient:
    """A client of one service, which sends an API key if it has one; a context manager."""

    def __init__(
        self, url: str, transport: httpx.BaseTransport | None = None, key: str | None = None
    ) -> None:
        self.url = url.rstrip("/")
        self._client = service_client(self.url, _TIMEOUT_SECONDS, transport, key)

    def __enter__(self) -> ApiClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    def instance(self) -> str | None:
        """Return the name of the server that answers (SPINEWATCH_INSTANCE_ID), None when none does."""
        try:
            answer = self._client.get("/health/live", timeout=1.0)
            return str(answer.json()["instance"]) if answer.is_success else None
        except (httpx.HTTPError, ValueError, LookupError, TypeError):  # or another program answers
            return None

    def add_calibration(self, rig_json: bytes) -> str:
        """Store a rig and return the identifier of the calibration."""
        headers = {"Content-Type": "application/json"}
        return self._identifier("/v1/calibrations", content=rig_json, headers=headers)

    def add_surgery(self, surgery: Document) -> str:
        """Store a surgery and return its identifier."""
        return self._identifier("/v1/surgeries", json=surgery)

    def put_spine_setup(self, surgery_id: str, setup_json: bytes) -> None:
        """Store the setup of a new surgery's spine."""
        headers = {"Content-Type": "application/json"}
        self._request("PUT", f"/v1/surgeries/{surgery_id}/spine", content=setup_json, headers=headers)

    def submit_stage(self, surgery_id: str, name: str, calibration_id: str, folder: Path) -> SubmittedStage:
        """Submit ``left.png`` and ``right.png`` of a folder as a stage."""
        files = {side: (f"{side}.png", read_image(folder / f"{side}.png"), "image/png") for side in _SIDES}
        fields = {"name": name, "calibration_id": calibration_id}
        response = self._request("POST", f"/v1/surgeries/{surgery_id}/stages", data=fields, files=files)
        if "Location" not in response.headers:
            raise self._other_program()
        return SubmittedStage(name, response.headers["Location"])

    def get(self, path: str) -> Document:
        """Return the JSON document at a path."""
        return self._document(self._request("GET", path))

    def _request(self, method: str, path: str, **content: Any) -> httpx.Response:
        response = answer(self._client, method, path, **content)
        if response.is_success:
            return response
        raise ServiceError(f"{method} {path}: {problem_text(response)}")

    def _identifier(self, path: str, **content: Any) -> str:
        """Return the identifier of what a POST stored."""
        document = self._document(self._request("POST", path, **content))
        if "id" not in document:
            raise self._other_program()
        return str(document["id"])

    def _document(self, response: httpx.Response) -> Document:
        document = _json(response)
        if document is None:
            raise self._other_program()
        return document

    def _other_program(self) -> ServiceError:
        return ServiceError(f"the answer of {self.url} is none of Spinewatch; check the address")


def service_client(
    url: str, timeout_seconds: float, transport: httpx.BaseTransport | None, key: str | None
) -> httpx.Client:
    """Return a client of the service at a URL; raises ``ServiceError`` for what is no URL and for an impossible key."""
    headers = bearer(key)
    try:
        return httpx.Client(
            base_url=url, timeout=timeout_seconds, trust_env=False, transport=transport, headers=headers
        )
    except (httpx.InvalidURL, UnicodeError) as error:
        raise ServiceError(
            f"{url!r} is no address of a service: {error}; write it like http://127.0.0.1:8000"
        ) from error


def answer(client: httpx.Client, method: str, path: str, **content: Any) -> httpx.Response:
    """Return the response to a request, whatever its status; raises ``ServiceError`` when there is none."""
    try:
        return client.request(method, path, **content)
    except (httpx.HTTPError, httpx.InvalidURL, UnicodeError) as error:  # UnicodeError: of a name of no host
        url = str(client.base_url).rstrip("/")
        raise ServiceError(f"no answer from {url}: {error}; is the service running?") from error


def bearer(key: str | None) -> dict[str, str]:
    """Return the header that sends an API key; raises ``ServiceError`` for one that no header can hold."""
    if key is None:
        return {}
    key = key.strip()
    if not key.isascii() or not key.isprintable():
        raise ServiceError("the API key has characters that none has; copy it again")
    return {"Authorization": f"Bearer {key}"}


def problem_text(response: httpx.Response) -> str:
    """Return the status of a response and the detail of its problem document, if it has one."""
    if response.headers.get("Content-Type", "").startswith("application/problem+json"):
        problem = _json(response) or {}
        reason = problem.get("detail") or problem.get("title") or response.reason_phrase
        return f"{response.status_code} {reason}"
    return f"{response.status_code} {response.reason_phrase}"


def _json(response: httpx.Response) -> Document | None:
    """Return the JSON object of a response, None if it has none."""
    try:
        document = response.json()
    except (ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None
