import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from contract.audit import AuditEvent
from exports.audit_fhir import export

Validate = Callable[..., Any]
EVENT: dict[str, Any] = {
    "seq": 7, "at": datetime(2026, 11, 21, 12, tzinfo=UTC), "action": "stage:submitted", "resource": "stage",
    "subject_id": "t", "surgery_id": "s", "actor_kind": "http", "actor_name": "k3vq7mzd cart 1",
    "actor_key": "k3vq7mzd", "address": "10.0.0.7", "request_id": "r1", "outcome": "success", "detail": None,
    "hash": "0" * 64,
}  # fmt: skip
EVENTS = [
    EVENT,
    EVENT | {"action": "surgery:deleted", "resource": "surgery", "subject_id": "s", "hash": "1" * 64},
    EVENT | {"action": "request:refused", "outcome": "refused", "detail": "GET /v1/keys: 403", "hash": "2" * 64},
    EVENT | {"action": "session:started", "hash": "3" * 64, "surgery_id": None, "request_id": None},
    EVENT | {"actor_kind": "worker", "actor_name": "cart:17", "actor_key": None, "address": None,
             "action": "job:failed", "outcome": "failed", "hash": "4" * 64},
    EVENT | {"actor_kind": "command", "actor_name": "\x00\u202e<script>", "actor_key": None, "address": None,
             "action": "surgery:purged", "hash": "5" * 64},
    EVENT | {"actor_name": "", "actor_key": None, "address": None, "action": "x", "resource": "x", "hash": "6" * 64},
]  # fmt: skip


@pytest.fixture(scope="module")
def bundle() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(export([AuditEvent(**event) for event in EVENTS], "or-4"))
    return loaded


def errors(validate: Validate, bundle: dict[str, Any], folder: Path) -> list[Any]:
    path = folder / "bundle.json"
    path.write_text(json.dumps(bundle))
    found = validate("fhir.mjs", path)
    return [message for message in found["messages"] if message["severity"] in {"error", "fatal"}]


def test_the_npm_package_fhir_finds_no_error(
    validate: Validate, bundle: dict[str, Any], tmp_path: Path
) -> None:
    assert errors(validate, bundle, tmp_path) == []


@pytest.mark.parametrize(
    "change", [{"outcome": "5"}, {"agent": []}, {"recordet": "x"}, {"action": "X"}, {"source": {"type": []}}]
)
def test_the_npm_package_fhir_refuses_what_is_wrong(
    change: dict[str, Any], validate: Validate, bundle: dict[str, Any], tmp_path: Path
) -> None:
    broken = json.loads(json.dumps(bundle))
    broken["entry"][0]["resource"].update(change)
    assert errors(validate, broken, tmp_path)


def test_a_request_names_client_server_resource_and_request(bundle: dict[str, Any]) -> None:
    first = bundle["entry"][0]["resource"]
    assert first["meta"]["profile"] == [
        "https://profiles.ihe.net/ITI/BALP/StructureDefinition/IHE.BasicAudit.Create"
    ]
    assert (first["action"], first["outcome"], first["recorded"]) == ("C", "0", "2026-11-21T12:00:00+00:00")
    client, server = first["agent"]
    assert (client["who"]["identifier"]["value"], client["network"]["address"]) == ("k3vq7mzd", "10.0.0.7")
    assert (client["requestor"], server["requestor"], server["network"]["address"]) == (True, False, "or-4")
    stage, surgery, request = first["entity"]
    assert [e["what"]["identifier"]["value"] for e in (stage, surgery, request)] == ["t", "s", "r1"]
    assert {d["type"]: d["valueString"] for d in stage["detail"]} == {
        "action": "stage:submitted",
        "sequence": "7",
        "sha256": "0" * 64,
    }


def test_a_deletion_claims_no_profile_because_its_entity_has_details(bundle: dict[str, Any]) -> None:
    deleted = bundle["entry"][1]["resource"]
    assert (deleted["action"], deleted["subtype"][0]["code"]) == ("D", "delete")
    assert "meta" not in deleted
    assert {detail["type"] for detail in deleted["entity"][0]["detail"]} == {"action", "sequence", "sha256"}


def test_outcomes_and_actions_have_their_codes(bundle: dict[str, Any]) -> None:
    resources = [entry["resource"] for entry in bundle["entry"]]
    assert [r["outcome"] for r in resources] == ["0", "0", "4", "0", "8", "0", "0"]
    assert [r["action"] for r in resources] == ["C", "D", "E", "E", "E", "D", "E"]
    assert resources[2]["outcomeDesc"] == "GET /v1/keys: 403"
    assert resources[5]["agent"][0]["who"]["display"] == "  <script>"
    assert len({entry["fullUrl"] for entry in bundle["entry"]}) == len(EVENTS)


def test_no_events_are_a_bundle_without_entries() -> None:
    assert json.loads(export([], "or-4")) == {"resourceType": "Bundle", "type": "collection"}
