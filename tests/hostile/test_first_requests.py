"""Many anonymous clients ask for the API document as soon as the service is there."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx

from service.openapi import CONTRACT
from tests.hostile.attack import PATIENCE_S
from tests.hostile.liveness import cpu_clock_s
from tests.http.harness import Service

CLIENTS = 30
MAX_CPU_S = 8.0
"""CPU time of the API for all of them; 30 documents would take 20 s, and one takes 1 s."""


def test_the_api_document_is_made_once(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        before = cpu_clock_s(service.server.pid)

        def ask(_: int) -> bytes:
            with httpx.Client(
                base_url=service.client.base_url, timeout=4 * PATIENCE_S, trust_env=False
            ) as client:
                answer = client.get("/openapi.json")
                assert answer.status_code == 200
                return answer.content

        with ThreadPoolExecutor(CLIENTS) as pool:
            (document,) = set(pool.map(ask, range(CLIENTS)))
        assert cpu_clock_s(service.server.pid) - before < MAX_CPU_S
    assert json.loads(document) == json.loads(CONTRACT.read_text())
