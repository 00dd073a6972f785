"""Where a command reads the summary of a surgery: a running service, or a JSON file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Protocol
from urllib.parse import quote

import httpx
from pydantic import ValidationError

from commands.shared.api_client import ServiceError, bearer, problem_text
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
        self._path = f"/v1/surgeries/{quote(surgery_id, safe='')}/summary"
        self._tag: str | None = None
        self._client = httpx.Client(
            base_url=self._url,
            timeout=_TIMEOUT_SECONDS,
            trust_env=False,
            transport=transport,
            headers=bearer(key),
        )

    def changed(self) -> SurgerySummary | None:
        """Return the summary, None when the service has the one of the last call; raises ``ServiceError``."""
        headers = {} if self._tag is None else {"If-None-Match": self._tag}
        try:
            response = self._client.get(self._path, headers=headers)
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceError(f"no answer from {self._url}: {error}; is the service running?") from error
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
