"""Pages of other origins and names that resolve to the service (DNS rebinding)."""

from collections.abc import Iterator

import httpx
import pytest

from tests.hostile.attack import JSON, exchange, head, status
from tests.http.harness import Service, code_of

SURGERY = (
    b'{"reference": "case-9", "vertebrae": ["L1", "T11"], "reference_vertebra": "L1", "spine_axis": "x"}'
)
FOREIGN = [
    {"Origin": "http://example.org"},
    {"Origin": "https://127.0.0.1.example.org"},
    {"Origin": "http://127.0.0.1:1"},
    {"Origin": "null"},
    {"Origin": "file://"},
    {"Origin": "http://[::1"},
    {"Origin": ""},
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Sec-Fetch-Site": "cross-site", "Origin": "http://127.0.0.1"},
]


@pytest.mark.parametrize("headers", FOREIGN)
@pytest.mark.parametrize(
    ("kind", "path"),
    [
        ("application/json", "/v1/surgeries"),
        ("text/plain", "/v1/surgeries"),
        ("application/x-www-form-urlencoded", "/v1/surgeries"),
        ("multipart/form-data; boundary=x", "/v1/calibrations/from-images"),
        ("text/plain", "/v1/jobs/none/cancel"),
    ],
)
def test_a_foreign_page_changes_nothing(
    service: Service, headers: dict[str, str], kind: str, path: str
) -> None:
    answer = service.client.post(path, content=SURGERY, headers={"Content-Type": kind, **headers})
    assert code_of(answer, 403) == "foreign-origin"


def test_a_foreign_page_reads_nothing(service: Service) -> None:
    """Without CORS headers, a browser shows the page no answer."""
    answer = service.client.get("/v1/surgeries", headers={"Origin": "http://example.org"})
    assert not [name for name in answer.headers if name.startswith("access-control")]
    preflight = service.client.options(
        "/v1/surgeries", headers={"Origin": "http://example.org", "Access-Control-Request-Method": "POST"}
    )
    assert preflight.status_code >= 400
    assert not [name for name in preflight.headers if name.startswith("access-control")]


def test_the_services_own_pages_may_change_something(service: Service) -> None:
    own = {"Origin": f"http://127.0.0.1:{service.port}", "Sec-Fetch-Site": "same-origin"}
    answer = service.client.post("/v1/surgeries", content=SURGERY, headers={**JSON, **own})
    assert answer.status_code == 201


HOSTS = [
    "example.org",
    "127.0.0.1.example.org",
    "0.0.0.0",  # noqa: S104
    "127.0.0.1@example.org",
    "a b",
    "[::1",
    "",
    "127.0.0.1:x",
    "x" * 3_000,
]


@pytest.mark.parametrize("host", HOSTS)
def test_another_host_is_not_served(service: Service, host: str) -> None:
    request = head(service, "GET /v1/surgeries HTTP/1.1").replace(
        f"Host: 127.0.0.1:{service.port}".encode(), f"Host: {host}".encode()
    )
    answer = exchange(service, request)
    assert status(answer) in {400, 421}
    assert b"example.org" not in answer


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:80", "127.0.0.1", "[::1]:8000"])
def test_loopback_names_are_served(service: Service, host: str) -> None:
    assert service.client.get("/v1/health", headers={"Host": host}).status_code == 200


@pytest.fixture(scope="module")
def configured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    with Service(
        tmp_path_factory.mktemp("configured"),
        SPINEWATCH_ALLOWED_HOSTS="spine.example, other.example",
        SPINEWATCH_ALLOWED_ORIGINS="https://dashboard.example",
    ) as service:
        yield service


def test_names_and_origins_that_are_allowed(configured: Service) -> None:
    page = {"Host": "spine.example", "Origin": "https://dashboard.example", "Sec-Fetch-Site": "cross-site"}
    answer = configured.client.post("/v1/surgeries", content=SURGERY, headers={**JSON, **page})
    assert answer.status_code == 201
    assert answer.headers["access-control-allow-origin"] == "https://dashboard.example"
    preflight: httpx.Response = configured.client.options(
        "/v1/surgeries",
        headers={
            **page,
            "Access-Control-Request-Method": "POST",
            "Access-Control-Request-Headers": "authorization",
        },
    )
    assert preflight.status_code == 200
    other = {"Host": "spine.example", "Origin": "https://example.org"}
    answer = configured.client.post("/v1/surgeries", content=SURGERY, headers={**JSON, **other})
    assert code_of(answer, 403) == "foreign-origin"
