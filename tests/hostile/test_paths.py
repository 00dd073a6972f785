"""Paths and queries that look like files, other hosts, SQL or formulas."""

import json
from urllib.parse import quote

import pytest

from tests.hostile.attack import exchange, harmless, head, refused, status
from tests.http.harness import RIG, Service, code_of, problem_of

PATHS = [
    "/../../../../etc/passwd",
    "/docs/assets/../../../../etc/passwd",
    "/docs/assets/..%2f..%2f..%2f..%2fetc%2fpasswd",
    "/docs/assets/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
    "/docs/assets/..%5c..%5cwindows",
    "/docs/assets//etc/passwd",
    "/docs/assets/%00",
    "/v1/surgeries/%00",
    "/v1/surgeries/a%0d%0aX-Injected:%201",
    "/v1/surgeries/..%2f..%2fjobs",
    "/v1/surgeries/%2e%2e",
    "/v1/surgeries/none%2fstages",
    "/v1//surgeries",
    "//example.org/v1/surgeries",
    "/v1/surgeries/%ff%fe",
    "/v1/surgeries/%ed%a0%80",
    "/v1/surgeries/%",
    "/v1/surgeries/" + "x" * 3_000,
    "/v1/surgeries/" + "%F0%9F%A6%B4" * 300,
    "/v1/surgeries/" + "a/" * 1_500,
    "/v1/jobs/" + quote("' OR '1'='1"),
    "/v1/jobs/" + quote("'; DROP TABLE jobs; --"),
    "/v1/jobs/" + quote('" UNION SELECT * FROM surgeries --'),  # noqa: S608
    "/v1/jobs/" + quote("%' ESCAPE '\\"),
    "/v1/jobs/" + quote("${jndi:ldap://example.org/a}"),
    "/v1/jobs/" + quote("{{7*7}}"),
    "/v1/calibrations/" + quote("<script>alert(1)</script>"),
    "/v1/calibrations/" + quote("\u202egnp.exe"),
]


@pytest.mark.parametrize("path", PATHS)
def test_a_path_leads_nowhere(service: Service, path: str) -> None:
    with harmless(service):
        answer = exchange(service, head(service, f"GET {path} HTTP/1.1"))
    assert status(answer) in {400, 404, 422}
    assert b"application/problem+json" in answer
    for leaked in (b"root:", b"X-Injected", b"<script>", b"jndi"):
        assert leaked not in answer


@pytest.mark.parametrize("path", ["/v1/surgeries/", "/v1/surgeries/none/stages/", "/v1/health/"])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_slash_at_the_end_does_not_redirect(service: Service, path: str, host: str) -> None:
    answer = service.client.get(path, headers={"Host": host})
    problem = problem_of(answer, 404)
    assert "leave out the slash" in problem["detail"]
    assert problem["detail"].endswith(path.rstrip("/").replace("none", "{surgery_id}"))
    assert "location" not in answer.headers


QUERIES = [
    "colour=blue",
    "limit=1&limit=2",
    "limit=1&LIMIT=2",
    "limit=1;offset=2",
    "limit=1%00",
    "limit=" + "9" * 3_000,
    "limit=1e3",
    "limit=-1",
    "limit=" + quote("1 OR 1=1"),
    "offset=" + quote("0; DROP TABLE surgeries"),
    "&".join(f"p{n}=1" for n in range(45)),
    "%00=1",
    "%ff%fe=1",
    "=",
    "limit",
    "[$ne]=1",
    "__proto__=1",
]


@pytest.mark.parametrize("query", QUERIES)
def test_a_query_is_refused(service: Service, query: str) -> None:
    with harmless(service):
        answer = service.client.get(f"/v1/surgeries?{query}")
    assert len(refused(service, answer)["errors"]) <= 20


def test_too_many_parameters(service: Service) -> None:
    answer = service.client.get("/v1/surgeries?" + "a=1&" * 900)
    assert code_of(answer, 414) == "uri-too-long"


def test_an_unknown_parameter_is_named_and_the_known_ones_listed(service: Service) -> None:
    (error,) = problem_of(service.client.get("/v1/surgeries?colour=x"), 422)["errors"]
    assert error["loc"] == ["query", "colour"]
    assert "limit" in error["msg"]


def test_every_route_refuses_an_unknown_parameter(service: Service) -> None:
    document = service.client.get("/openapi.json").json()
    for template, operations in document["paths"].items():
        path = template.replace("{side}", "left").replace("{format}", "csv").replace("{number}", "1")
        for method in operations:
            answer = service.client.request(method, path.replace("{", "").replace("}", "") + "?c0ffee=1")
            assert "c0ffee" in str(problem_of(answer, 422)["errors"]), f"{method} {template}"


def test_every_time_in_a_query_says_how_a_plus_is_written(service: Service) -> None:
    document = service.client.get("/openapi.json").json()
    tried = 0
    for template, operations in document["paths"].items():
        for method, operation in operations.items():
            for parameter in operation.get("parameters", ()):
                if parameter["in"] != "query" or "date-time" not in str(parameter["schema"]):
                    continue
                query = f"{parameter['name']}=2026-11-21T10:30:00+01:00"
                kind = {
                    "Content-Type": next(iter(operation.get("requestBody", {}).get("content", {"*/*": 0})))
                }
                answer = service.client.request(
                    method,
                    f"{template.replace('{', '').replace('}', '')}?{query}",
                    content=json.dumps(RIG).encode(),
                    headers=kind,
                )
                assert "%2B" in answer.text, f"{method} {template}"
                tried += 1
    assert tried
