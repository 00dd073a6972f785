"""Access over HTTP: keys, scopes, sessions, and what is answered without a key."""

import http.client
import json
import re
import ssl
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from contract.key import Scope
from service.scopes import SCOPES
from tests.backends import everything_stored
from tests.http.harness import RIG, Service, code_of, problem_of, wait_for
from tests.patience import PATIENCE_S

ROUTES = sorted(name for name, needed in SCOPES.items() if needed)
NOBODY = "0" * 36
WRONG = "sw_aaaaaaaa_" + "a" * 52


def path_of(template: str) -> str:
    return re.sub(r"\{[a-z_]+\}", NOBODY, template)


@pytest.fixture
def anonymous(service: Service) -> Iterator[httpx.Client]:
    """A client without a key."""
    with httpx.Client(base_url=service.client.base_url, timeout=30, trust_env=False) as client:
        yield client


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


@pytest.mark.parametrize("name", ROUTES)
def test_no_route_but_liveness_answers_without_a_key(anonymous: httpx.Client, name: str) -> None:
    method, _, template = name.partition(" ")
    answer = anonymous.request(method, path_of(template))
    assert code_of(answer, 401) == "key-missing"
    assert answer.headers["WWW-Authenticate"] == 'Bearer realm="spinewatch"'
    assert "spinewatch key create" in answer.json()["detail"]


@pytest.mark.parametrize("path", ["/v1/nothing", "/etc/passwd", "/v1/surgeries/", "/docs/nothing"])
def test_without_a_key_nobody_learns_which_paths_there_are(anonymous: httpx.Client, path: str) -> None:
    assert anonymous.get(path).status_code == 401


def test_what_contains_no_data_is_open(anonymous: httpx.Client) -> None:
    for path in ("/", "/icon.svg", "/health/live", "/v1/health", "/docs", "/openapi.json"):
        assert anonymous.get(path).status_code == 200, path
        assert anonymous.head(path).status_code == 200, path


def test_an_upload_without_a_key_is_refused_before_it_is_read(service: Service) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", service.port, timeout=10)
    connection.putrequest("POST", "/v1/calibrations/from-images")
    connection.putheader("Content-Type", "multipart/form-data; boundary=x")
    connection.putheader("Content-Length", str(30 * 2**20))
    connection.endheaders()
    assert connection.getresponse().status == 401  # no byte of the body has been sent
    connection.close()


@pytest.mark.parametrize(
    "header",
    [
        "Bearer",
        "Bearer x",
        "Basic YTpi",
        "Bearer sw_aaaaaaaa_" + "a" * 52,
        "sw",
        "Bearer " + "a" * 4000,
    ],
)
def test_another_credential_is_refused(anonymous: httpx.Client, header: str) -> None:
    answer = anonymous.get("/v1/surgeries", headers={"Authorization": header})
    assert code_of(answer, 401) == "key-invalid"
    assert 'error="invalid_token"' in answer.headers["WWW-Authenticate"]


def test_two_authorization_headers_are_none(service: Service, anonymous: httpx.Client) -> None:
    headers = [("Authorization", f"Bearer {service.key}"), ("Authorization", "Bearer other")]
    assert code_of(anonymous.get("/v1/surgeries", headers=headers), 401) == "key-invalid"


def test_what_is_no_key_does_not_count_as_an_attempt(anonymous: httpx.Client) -> None:
    statuses = {anonymous.get("/v1/surgeries", headers=bearer("a guess")).status_code for _ in range(40)}
    assert statuses == {401}


@pytest.mark.parametrize("scope", Scope)
def test_a_key_does_what_its_scope_permits_and_no_more(
    service: Service, anonymous: httpx.Client, scope: Scope
) -> None:
    key = service.make_key(scope)
    for name in ROUTES:
        method, _, template = name.partition(" ")
        if template == "/v1/session":
            continue
        with anonymous.stream(
            method, path_of(template), headers=bearer(key)
        ) as answer:  # one of them never ends
            if scope is Scope.ADMIN or scope in SCOPES[name]:
                assert answer.status_code not in {401, 403}, name
                continue
            answer.read()
        assert code_of(answer, 403) == "scope-missing", name
        assert all(needed in answer.headers["WWW-Authenticate"] for needed in SCOPES[name])


def test_a_cart_can_send_and_follow_what_it_sent(service: Service, anonymous: httpx.Client) -> None:
    headers = bearer(service.make_key(Scope.CAPTURE_WRITE))
    made = anonymous.post("/v1/calibrations", json=RIG, headers=headers)
    assert made.status_code == 201
    assert anonymous.get(made.headers["Location"], headers=headers).status_code == 200
    assert anonymous.get("/v1/surgeries", headers=headers).status_code == 403


def test_keys_are_made_shown_once_and_revoked_over_http(service: Service, anonymous: httpx.Client) -> None:
    body = {"name": "cart 7", "scopes": ["capture:write", "stage:read"], "expires_in_days": 30}
    made = service.client.post("/v1/keys", json=body)
    assert made.status_code == 201, made.text
    document = made.json()
    key, prefix = document.pop("key"), document["prefix"]
    assert made.headers["Location"] == f"/v1/keys/{prefix}"
    assert made.headers["Cache-Control"] == "no-store"
    assert key.startswith(f"sw_{prefix}_")
    assert anonymous.get("/v1/surgeries", headers=bearer(key)).status_code == 200
    shown = service.client.get(f"/v1/keys/{prefix}")
    assert key.rpartition("_")[2] not in shown.text
    assert {**shown.json(), "last_used_at": None} == document
    assert document in [{**item, "last_used_at": None} for item in all_keys(service)]
    assert service.client.delete(f"/v1/keys/{prefix}").json()["revoked_at"] is not None
    refused = anonymous.get("/v1/surgeries", headers=bearer(key))
    assert code_of(refused, 401) == "key-invalid"
    assert service.client.delete(f"/v1/keys/{prefix}").status_code == 200
    assert code_of(service.client.delete("/v1/keys/aaaaaaaa"), 404) == "key-not-found"
    assert key.encode() not in everything_stored(service.database_url)


def all_keys(service: Service) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = []
    cursor: dict[str, str] = {}
    while True:
        page = service.client.get("/v1/keys", params={"limit": "200", **cursor}).json()
        items += page["items"]
        if page["next_cursor"] is None:
            return items
        cursor = {"cursor": page["next_cursor"]}


@pytest.mark.parametrize(
    "body",
    [
        {"name": "x", "scopes": []},
        {"name": "x", "scopes": ["everything"]},
        {"name": "<b>", "scopes": ["admin"]},
        {"name": "x", "scopes": ["admin"], "expires_in_days": 0},
    ],
)
def test_a_key_that_makes_no_sense_is_refused(service: Service, body: dict[str, Any]) -> None:
    assert code_of(service.client.post("/v1/keys", json=body), 422) == "invalid-request"


def test_the_last_use_of_a_key_is_kept(service: Service, anonymous: httpx.Client) -> None:
    key = service.make_key(Scope.STAGE_READ)
    path = f"/v1/keys/{key.split('_')[1]}"
    assert service.client.get(path).json()["last_used_at"] is None
    before = datetime.now(UTC)
    anonymous.get("/v1/surgeries", headers=bearer(key))
    used = wait_for(lambda: service.client.get(path).json()["last_used_at"], "the use to be stored")
    assert before <= datetime.fromisoformat(used) <= datetime.now(UTC)


def test_who_acts_is_in_the_events(service: Service, anonymous: httpx.Client) -> None:
    key = service.make_key(Scope.CAPTURE_WRITE)
    made = anonymous.post("/v1/calibrations", json=RIG, headers=bearer(key))
    query = "SELECT actor_name FROM events WHERE subject_id = ? AND action = 'calibration:created'"
    ((actor,),) = service.sql(query, made.json()["id"])
    assert actor == f"{key.split('_')[1]} test"


def test_failed_attempts_are_limited_without_shutting_out_who_has_a_key(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        assert service.client.get("/v1/surgeries").status_code == 200
        with httpx.Client(base_url=service.client.base_url, trust_env=False) as other:
            statuses = [other.get("/v1/surgeries", headers=bearer(WRONG)).status_code for _ in range(25)]
            assert statuses == [401] * 20 + [429] * 5
            answer = other.get("/v1/surgeries", headers=bearer(WRONG))
            assert 1 <= int(answer.headers["Retry-After"]) <= 60
            assert code_of(answer, 429) == "too-many-attempts"
            assert other.get("/health/live").status_code == 200
        assert service.client.get("/v1/surgeries").status_code == 200


def test_a_valid_key_is_taken_whatever_failed_from_its_address_before(tmp_path: Path) -> None:
    """Neither a key that the service has not seen since its start, nor one that was made just now, nor a session."""
    with (
        Service(tmp_path) as service,
        httpx.Client(base_url=service.client.base_url, timeout=PATIENCE_S, trust_env=False) as client,
    ):
        unseen = service.make_key(Scope.STAGE_READ)
        revoked = service.client.post("/v1/keys", json={"name": "old", "scopes": ["stage:read"]}).json()
        assert service.client.delete(f"/v1/keys/{revoked['prefix']}").status_code == 200
        statuses = [
            client.get("/v1/surgeries", headers=bearer(revoked["key"])).status_code for _ in range(25)
        ]
        assert statuses == [401] * 20 + [429] * 5
        for key in (unseen, service.make_key(Scope.STAGE_READ)):
            assert client.get("/v1/surgeries", headers=bearer(key)).status_code == 200
            opened = client.post("/v1/session", headers=bearer(key))
            assert opened.status_code == 201
            assert client.get("/v1/surgeries").status_code == 200
            client.cookies.clear()


# Sessions

OWN = {"Sec-Fetch-Site": "same-origin"}


@pytest.fixture
def browser(service: Service, anonymous: httpx.Client) -> httpx.Client:
    """A client with a session of a key that may do everything, and without the key."""
    answer = anonymous.post("/v1/session", headers=bearer(service.make_key()))
    assert answer.status_code == 201, answer.text
    return anonymous


def test_a_key_makes_a_session_with_a_cookie_that_no_script_reads(
    service: Service, anonymous: httpx.Client
) -> None:
    key = service.make_key(Scope.STAGE_READ)
    answer = anonymous.post("/v1/session", headers=bearer(key))
    cookie = answer.headers["Set-Cookie"]
    parts = {part.strip().lower() for part in cookie.split(";")[1:]}
    assert {"httponly", "samesite=strict", "path=/"} <= parts
    assert "secure" not in parts  # this service has no TLS
    assert any(part.startswith("max-age=432") or part.startswith("max-age=431") for part in parts)
    token = cookie.partition(";")[0].partition("=")[2]
    assert token not in answer.text
    assert key not in cookie
    document = answer.json()
    assert (document["session"], document["scopes"], document["name"]) == (True, ["stage:read"], "test")
    assert anonymous.get("/v1/session").json() == document
    assert anonymous.get("/v1/surgeries").status_code == 200
    assert code_of(anonymous.get("/v1/keys"), 403) == "scope-missing"
    assert token.encode() not in everything_stored(service.database_url)


def test_a_key_says_who_it_is(service: Service, anonymous: httpx.Client) -> None:
    key = service.make_key(Scope.CAPTURE_WRITE)
    document = anonymous.get("/v1/session", headers=bearer(key)).json()
    assert document == {
        "key": key.split("_")[1],
        "name": "test",
        "scopes": ["capture:write"],
        "session": False,
        "expires_at": None,
    }


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        (OWN, 201),
        ({"Origin": "{own}"}, 201),
        ({"Origin": "{own}", **OWN}, 201),
        ({}, 403),
        ({"Sec-Fetch-Site": "none"}, 403),
        ({"Sec-Fetch-Site": "same-site"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Origin": "{own}"}, 403),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
    ],
)
def test_a_cookie_changes_something_only_from_a_page_of_the_service(
    service: Service, browser: httpx.Client, headers: dict[str, str], status: int
) -> None:
    own = {name: value.format(own=f"http://127.0.0.1:{service.port}") for name, value in headers.items()}
    answer = browser.post("/v1/calibrations", json=RIG, headers=own)
    assert answer.status_code == status, answer.text
    if status == 403:
        assert code_of(answer, 403) == "foreign-origin"


def test_a_session_ends_when_it_is_deleted(service: Service, browser: httpx.Client) -> None:
    token = browser.cookies["spinewatch_session"]
    assert browser.delete("/v1/session").status_code == 403
    assert browser.delete("/v1/session", headers=OWN).status_code == 204
    assert not dict(browser.cookies)
    again = browser.get("/v1/session", headers={"Cookie": f"spinewatch_session={token}"})
    assert code_of(again, 401) == "session-ended"


def test_a_session_ends_with_its_key(service: Service, anonymous: httpx.Client) -> None:
    key = service.make_key(Scope.STAGE_READ)
    assert anonymous.post("/v1/session", headers=bearer(key)).status_code == 201
    service.client.delete(f"/v1/keys/{key.split('_')[1]}")
    assert code_of(anonymous.get("/v1/surgeries"), 401) == "session-ended"


def test_a_session_makes_no_session(browser: httpx.Client) -> None:
    assert code_of(browser.post("/v1/session", headers=OWN), 403) == "key-required"


# TLS and addresses


def refusal(*arguments: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "commands", *arguments],
        env={"PATH": "", "SPINEWATCH_DATABASE_URL": f"sqlite:///{folder / 'x.sqlite'}"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    return done.stderr


@pytest.mark.parametrize("command", ["run", "serve"])
@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "cart.example"])  # noqa: S104
def test_a_network_needs_tls(tmp_path: Path, command: str, host: str) -> None:
    said = refusal(command, "--host", host, folder=tmp_path)
    assert "--tls-cert" in said
    assert "--behind-proxy" in said
    assert list(tmp_path.iterdir()) == []


def test_useless_certificates_are_named(tmp_path: Path) -> None:
    nothing = str(tmp_path / "nothing.pem")
    assert "both" in refusal("serve", "--tls-cert", nothing, folder=tmp_path)
    files = ("--tls-cert", nothing, "--tls-key", nothing)
    assert "cannot read" in refusal("serve", *files, folder=tmp_path)
    Path(nothing).write_text("nothing")
    assert "no certificate" in refusal("serve", *files, folder=tmp_path)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate of 127.0.0.1 and its key."""
    folder = tmp_path_factory.mktemp("tls")
    cert, key = folder / "cert.pem", folder / "key.pem"
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=127.0.0.1"
    names = ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)]
    made = subprocess.run(
        ["openssl", *options.split(), *names],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    return cert, key


def test_with_tls_the_cookie_is_for_tls_alone(tmp_path: Path, certificate: tuple[Path, Path]) -> None:
    cert, key = certificate
    settings = {
        "SPINEWATCH_TLS_CERT": str(cert),
        "SPINEWATCH_TLS_KEY": str(key),
        "SPINEWATCH_HOST": "0.0.0.0",  # noqa: S104
    }
    service = Service(tmp_path, **settings)
    service.client.close()
    service.client = httpx.Client(
        base_url=f"https://127.0.0.1:{service.port}",
        verify=ssl.create_default_context(cafile=str(cert)),
        timeout=30,
        trust_env=False,
    )
    with service:
        answer = service.client.post("/v1/session")
        assert answer.status_code == 201
        assert "secure" in answer.headers["Set-Cookie"].lower()
        del service.client.headers["Authorization"]
        own = {"Origin": f"https://127.0.0.1:{service.port}"}
        assert service.client.post("/v1/calibrations", json=RIG, headers=own).status_code == 201
        with httpx.Client(trust_env=False) as plain, pytest.raises(httpx.HTTPError):
            plain.get(f"http://127.0.0.1:{service.port}/health/live")


FORWARDED = {"X-Forwarded-For": "192.0.2.7", "X-Forwarded-Proto": "https"}


@pytest.mark.parametrize(
    ("settings", "believed"),
    [
        ({}, False),
        ({"SPINEWATCH_TRUSTED_PROXIES": "127.0.0.1"}, False),
        ({"SPINEWATCH_BEHIND_PROXY": "true"}, True),
        ({"SPINEWATCH_BEHIND_PROXY": "true", "SPINEWATCH_TRUSTED_PROXIES": "192.0.2.0/24"}, False),
        ({"SPINEWATCH_BEHIND_PROXY": "true", "SPINEWATCH_TRUSTED_PROXIES": "192.0.2.0/24,127.0.0.0/8"}, True),
    ],
)
def test_only_a_trusted_proxy_names_the_client(
    tmp_path: Path, settings: dict[str, str], believed: bool
) -> None:
    with Service(tmp_path, **settings) as service:
        answer = service.client.post("/v1/session", headers=FORWARDED)
        assert ("secure" in answer.headers["Set-Cookie"].lower()) is believed
        for _ in range(25):
            last = httpx.get(
                f"{service.client.base_url}/v1/surgeries",
                headers={**bearer(WRONG), **FORWARDED},
                trust_env=False,
            )
        assert last.status_code == 429
        direct = httpx.get(f"{service.client.base_url}/v1/surgeries", headers=bearer(WRONG), trust_env=False)
        assert direct.status_code == (401 if believed else 429)  # another address, or the same one


def test_the_api_document_declares_what_is_needed(anonymous: httpx.Client) -> None:
    document = anonymous.get("/openapi.json").json()
    schemes = document["components"]["securitySchemes"]
    assert schemes["key"]["scheme"] == "bearer"
    assert schemes["session"]["name"] == "spinewatch_session"
    paths = document["paths"]
    assert paths["/v1/keys"]["post"]["security"] == [{"key": ["admin"]}, {"session": ["admin"]}]
    assert paths["/v1/session"]["post"]["security"] == [{"key": []}]
    assert paths["/health/live"]["get"]["security"] == []
    for operations in paths.values():
        for operation in operations.values():
            assert (not operation["security"]) or {"401", "403", "429"} <= set(operation["responses"])


def test_the_problem_says_what_to_do(anonymous: httpx.Client) -> None:
    document = problem_of(anonymous.get("/v1/surgeries"), 401)
    assert json.dumps(document).count("Bearer") == 1
    assert document["instance"].startswith("urn:spinewatch:request:")
