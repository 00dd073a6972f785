"""Where a command reads the summary of a surgery: a running service, or a JSON file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Protocol
from urllib.parse import quote

import httpx
from pydantic import ValidationError

from commands.shared.api_client import ServiceError, answer, problem_text, service_client
from commands.shared.files import InputError, read_bytes, read_json
from commands.shared.validation import first_problem
from contract.summary import SurgerySummary

_TIMEOUT_SECONDS = 10.0


class SummarySource(Protocol):
    """Gives the summary of one surgery again and again."""

    def changed(self) -> SurgerySummary | None:
        """Return the summary, None when it is the one of the last call; raises a ``SpinewatchError``."""


class FileSource:
    """A file with a ``SurgerySummary``, or with what ``export`` writes as JSON."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._last: bytes | None = None

    def changed(self) -> SurgerySummary | None:
        """Return the summary, None when the file is the one of the last call; raises ``InputError``."""
        content = read_bytes(self._path)
        if content == self._last:
            return None
        document = read_json(self._path)
        if isinstance(document, dict) and "summary" in document:
            document = document["summary"]
        try:
            summary = SurgerySummary.model_validate_json(json.dumps(document))
        except RecursionError as error:
            raise InputError(f"{self._path} is no summary of a surgery: it has too many levels") from error
        except ValidationError as error:
            raise InputError(f"{self._path} is no summary of a surgery: {first_problem(error)}") from error
        self._last = content
        return summary


class ServiceSource:
    """A surgery of a running service; an unchanged summary is not sent again."""

    def __init__(
        self,
        url: str,
        surgery_id: str,
        transport: httpx.BaseTransport | None = None,
        key: str | None = None,
    ) -> None:
        self._url = url.rstrip("/")
        self._path = f"/v1/surgeries/{quote(surgery_id, safe='', errors='surrogateescape')}/summary"
        self._tag: str | None = None
        self._client = service_client(self._url, _TIMEOUT_SECONDS, transport, key)

    def changed(self) -> SurgerySummary | None:
        """Return the summary, None when the service has the one of the last call; raises ``ServiceError``."""
        headers = {} if self._tag is None else {"If-None-Match": self._tag}
        response = answer(self._client, "GET", self._path, headers=headers)
        if response.status_code == httpx.codes.NOT_MODIFIED:
            return None
        if not response.is_success:
            raise ServiceError(f"GET {self._path}: {problem_text(response)}")
        try:
            summary = SurgerySummary.model_validate_json(response.content)
        except ValidationError as error:
            raise ServiceError(
                f"{self._url} has another version of the summary: {first_problem(error)}"
            ) from error
        self._tag = response.headers.get("ETag")
        return summary
