"""The audit, deletion, damaged images and metadata, as a client and an administrator see them."""

import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest
from PIL import Image, PngImagePlugin
from sqlalchemy import make_url, text

from contract.key import Scope
from store.database import Database
from store.images import digest
from tests.http.harness import Service, code_of, pair, wait_for
from tests.store.at_rest import without_triggers

CASE: dict[str, Any] = {"reference": "2026-0417", "vertebrae": ["L1", "T11"], "reference_vertebra": "L1"}
NAME = b"Anna Smith"


def audit(service: Service, **query: Any) -> list[dict[str, Any]]:
    answer = service.client.get("/v1/audit", params=query)
    assert answer.status_code == 200, answer.text
    items: list[dict[str, Any]] = answer.json()["items"]
    return items


def command(service: Service, *arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "commands", *arguments],
        env=service.environment | {"PATH": "/usr/bin:/bin"},
        input=given,
        capture_output=True,
        text=True,
        check=False,
    )


def named(content: bytes) -> bytes:
    """The image with a name in its metadata."""
    info = PngImagePlugin.PngInfo()
    info.add_text("Patient", NAME.decode())
    buffer = io.BytesIO()
    with Image.open(io.BytesIO(content)) as image:
        image.save(buffer, "PNG", pnginfo=info)
    return buffer.getvalue()


def test_a_change_is_an_event_with_key_address_and_request(idle: Service) -> None:
    answer = idle.client.post("/v1/surgeries", json=CASE)
    surgery = answer.json()["id"]
    (event,) = audit(idle, surgery_id=surgery)
    assert (event["action"], event["resource"], event["subject_id"]) == (
        "surgery:created",
        "surgery",
        surgery,
    )
    assert (event["outcome"], event["address"], event["actor_kind"]) == ("success", "127.0.0.1", "http")
    assert event["actor_key"] == idle.key.split("_")[1]
    assert event["request_id"] == answer.headers["x-request-id"]
    assert CASE["reference"] not in idle.client.get("/v1/audit").text


def test_the_audit_comes_in_pages_and_only_to_administrators(idle: Service) -> None:
    for _ in range(3):
        idle.surgery()
    page = idle.client.get("/v1/audit", params={"limit": 2}).json()
    following = idle.client.get("/v1/audit", params={"limit": 2, "cursor": page["next_cursor"]}).json()
    numbers = [item["seq"] for item in (*page["items"], *following["items"])]
    assert numbers == list(range(numbers[0], numbers[0] - 4, -1))
    for wrong in ({"cursor": "x"}, {"cursor": "0"}, {"surgery_id": ""}, {"since": "1"}):
        assert idle.client.get("/v1/audit", params=wrong).status_code == 422
    reader = {"Authorization": f"Bearer {idle.make_key(Scope.STAGE_READ)}"}
    assert code_of(idle.client.get("/v1/audit", headers=reader), 403) == "scope-missing"


def test_refused_requests_are_recorded_at_a_bounded_rate(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        reader = service.make_key(Scope.STAGE_READ)
        path = "/v1/surgeries/none"
        answer = service.client.delete(path, headers={"Authorization": f"Bearer {reader}"})
        assert answer.status_code == 403

        def refused() -> list[dict[str, Any]]:
            return [item for item in audit(service) if item["action"] == "request:refused"]

        (event,) = wait_for(refused, "the refusal in the audit")
        assert (event["outcome"], event["actor_key"]) == ("refused", reader.split("_")[1])
        assert event["detail"] == "DELETE /v1/surgeries/{surgery_id}: 403"
        assert event["request_id"] == answer.headers["x-request-id"]
        assert service.client.delete(path).status_code == 404
        with httpx.Client(base_url=service.client.base_url, trust_env=False) as stranger:
            for _ in range(30):
                assert stranger.get("/v1/surgeries").status_code in {401, 429}
        wait_for(lambda: len(refused()) >= 5, "five refusals")
        assert len(refused()) == 5
        assert {item["detail"].rpartition(": ")[2] for item in refused()} == {"403", "404", "401"}
        assert service.client.get("/v1/health").status_code == 200


def test_a_deleted_surgery_is_gone_on_every_path(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
    below = (
        "stages",
        "stages/PRE",
        "stages/PRE/triads",
        "stages/PRE/images/left",
        "summary",
        "radiographs",
        "spine",
    )
    paths = [f"/v1/surgeries/{surgery}", *(f"/v1/surgeries/{surgery}/{rest}" for rest in below)]
    reader = {"Authorization": f"Bearer {service.make_key(Scope.CAPTURE_WRITE, Scope.CORRECT_WRITE)}"}
    assert code_of(service.client.delete(paths[0], headers=reader), 403) == "scope-missing"
    assert service.client.delete(paths[0], params={"reason": "a\u202eb"}).status_code == 422
    assert service.client.delete(paths[0], params={"reason": "withdrawn"}).status_code == 204
    for path in paths:
        assert code_of(service.client.get(path), 410) == "surgery-deleted"
    assert code_of(service.client.delete(paths[0]), 410) == "surgery-deleted"
    assert code_of(service.send(surgery, "POST", pair("POST"), calibration), 410) == "surgery-deleted"
    assert surgery not in service.client.get("/v1/surgeries?limit=200").text
    assert audit(service, surgery_id=surgery)[0]["action"] == "surgery:deleted"
    assert code_of(service.client.delete("/v1/surgeries/none"), 404) == "surgery-not-found"


def test_metadata_are_not_stored_and_both_hashes_are(idle: Service) -> None:
    calibration, surgery = idle.calibration(), idle.surgery()
    left, right = pair("PRE")
    sent = named(left)
    assert NAME in sent
    answer = idle.send(surgery, "PRE", (sent, right), calibration)
    assert answer.status_code == 202, answer.text
    stored = idle.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/left")
    assert NAME not in stored.content
    assert stored.headers["etag"] == f'"{digest(stored.content)}"'
    with Image.open(io.BytesIO(stored.content)) as one, Image.open(io.BytesIO(left)) as other:
        assert one.tobytes() == other.tobytes()
    database = Database(idle.database_url)
    with database.read() as session:
        rows = session.execute(text("SELECT sent_sha256, sha256 FROM sent_images")).all()
    database.close()
    assert (digest(sent), digest(stored.content)) in [tuple(row) for row in rows]
    assert digest(right) not in {row.sent_sha256 for row in rows}
    kept = idle.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/right").content
    assert kept == right


@pytest.mark.parametrize(
    "reference", ["Anna Smith", "Smith 1970", "x", "", "1\u202e2", "1\x002", "1 ", "1" * 65]
)
def test_a_case_number_that_may_be_a_name_is_refused(idle: Service, reference: str) -> None:
    answer = idle.client.post("/v1/surgeries", json={**CASE, "reference": reference})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["loc"] == ["body", "reference"]
    assert not reference or reference not in json.dumps(answer.json()["errors"])


def test_a_site_sets_its_own_case_numbers(tmp_path: Path) -> None:
    with Service(tmp_path, SPINEWATCH_REFERENCE_PATTERN="[A-Z]{4}") as service:
        assert service.client.post("/v1/surgeries", json={**CASE, "reference": "ABCD"}).status_code == 201
        answer = service.client.post("/v1/surgeries", json=CASE)
        assert code_of(answer, 422) == "reference-not-opaque"


def test_a_damaged_image_is_never_served_and_its_job_fails(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        calibration, surgery = service.calibration(), service.surgery()
        job = service.submit(surgery, "PRE", pair("PRE"), calibration)
        sha256 = digest(pair("PRE")[0])
        with without_triggers(service.database_url, "images") as session:
            session.execute(
                text("UPDATE images SET content = :c WHERE sha256 = :s"), {"c": b"x", "s": sha256}
            )
        answer = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/left")
        assert code_of(answer, 500) == "image-damaged"
        assert service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/images/right").status_code == 200
        service.start("worker")
        ended = service.finished(job)
        assert ended["state"] == "failed"
        assert ended["error"]["type"] == "urn:spinewatch:problem:image-damaged"


def test_a_surgery_is_exported_and_purged_while_the_service_runs(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        calibration, surgery = service.calibration(), service.surgery()
        service.submit(surgery, "PRE", pair("PRE"), calibration)
        folder = str(tmp_path)
        options = ("purge", surgery, "--reason", "retention", "--export-to", folder)
        refused = command(service, *options, given="another number\n")
        assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
        assert service.client.get(f"/v1/surgeries/{surgery}").status_code == 200
        reference = service.client.get(f"/v1/surgeries/{surgery}").json()["reference"]
        done = command(service, *options, given=f"{reference}\n")
        assert done.returncode == 0, done.stderr
        assert "1 stages, 2 images removed" in done.stdout
        assert code_of(service.client.get(f"/v1/surgeries/{surgery}"), 410) == "surgery-deleted"
        assert (tmp_path / f"case-{surgery}.zip").stat().st_mode & 0o777 == 0o600
        if make_url(service.database_url).get_backend_name() == "sqlite":
            content = b"".join(file.read_bytes() for file in tmp_path.glob("spinewatch.sqlite*"))
            assert pair("PRE")[0][1000:1400] not in content
            assert reference.encode() not in content
            whole = command(service, "audit", "verify", str(service.database))
            assert (whole.returncode, "whole" in whole.stdout) == (0, True)
        again = command(service, "purge", surgery, "--reason", "retention", "--no-export", "--yes")
        assert (again.returncode, "no such surgery" in again.stderr) == (2, True)
        assert service.client.post("/v1/surgeries", json=CASE).status_code == 201
