"""FHIR R4 Bundle of AuditEvents after IHE Basic Audit Log Patterns (BALP): one for each event of the audit.

What an HTTP client created follows the profile BasicAudit.Create. A deletion follows none: BasicAudit.Delete allows no
details of its entity, and the number and the hash of each event are details of its entity, so that the chain can be
checked against the database. What workers and commands did has no client and follows none either.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from contract.audit import AuditEvent
from contract.event import ActorKind, Outcome
from exports.text import single_line

MEDIA_TYPE = "application/fhir+json"

Resource = dict[str, Any]

_CREATE_PROFILE = "https://profiles.ihe.net/ITI/BALP/StructureDefinition/IHE.BasicAudit.Create"
_ENTITY_TYPES = "https://profiles.ihe.net/ITI/BALP/CodeSystem/BasicAuditEntityType"
_DCM = "http://dicom.nema.org/resources/ontology/DCM"
_EVENT_TYPES = "http://terminology.hl7.org/CodeSystem/audit-event-type"
_OBJECT_TYPES = "http://terminology.hl7.org/CodeSystem/audit-entity-type"
_OBJECT_ROLES = "http://terminology.hl7.org/CodeSystem/object-role"
_SOURCE_TYPES = "http://terminology.hl7.org/CodeSystem/security-source-type"
_RESTFUL = "http://hl7.org/fhir/restful-interaction"
_IP_ADDRESS, _MACHINE_NAME = "2", "1"

_OUTCOMES = {Outcome.SUCCESS: "0", Outcome.REFUSED: "4", Outcome.FAILED: "8"}
_CREATING = frozenset({"created", "submitted", "added", "configured", "rebaselined", "revised"})
_DELETING = frozenset({"deleted", "purged", "revoked"})
_LOGINS = {"started": ("110122", "Login"), "ended": ("110123", "Logout")}


def export(events: Iterable[AuditEvent], server: str) -> bytes:
    """Return events of the audit as a FHIR R4 Bundle of type collection.

    Parameters
    ----------
    events
        The events, in order.
    server
        Name of the machine of the service.

    Returns
    -------
    bytes
        UTF-8 JSON. The same events give the same bytes.
    """
    entries = [{"fullUrl": f"urn:uuid:{r['id']}", "resource": r} for r in _resources(events, server)]
    bundle: Resource = {"resourceType": "Bundle", "type": "collection"}
    if entries:
        bundle["entry"] = entries
    return json.dumps(bundle, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def _resources(events: Iterable[AuditEvent], server: str) -> Iterator[Resource]:
    for event in events:
        yield _resource(event, single_line(server) or "spinewatch")


def _resource(event: AuditEvent, server: str) -> Resource:
    verb = event.action.partition(":")[2]
    resource: Resource = {
        "resourceType": "AuditEvent",
        "id": str(uuid5(NAMESPACE_URL, f"spinewatch:audit:{event.hash}")),
        **_kind(event, verb),
        "recorded": event.at.isoformat(),
        "outcome": _OUTCOMES[event.outcome],
        "agent": [*_agents(event, server)],
        "source": {
            "observer": {"display": server},
            "type": [_coding(_SOURCE_TYPES, "4", "Application Server")],
        },
        "entity": [*_entities(event)],
    }
    if event.outcome is not Outcome.SUCCESS and event.detail:
        resource["outcomeDesc"] = single_line(event.detail)
    return resource


def _kind(event: AuditEvent, verb: str) -> Resource:
    """Return profile, type, subtype and action."""
    if event.resource == "session" and verb in _LOGINS:
        kind = _coding(_DCM, "110114", "User Authentication")
        return {"type": kind, "subtype": [_coding(_DCM, *_LOGINS[verb])], "action": "E"}
    if event.actor_kind is not ActorKind.HTTP:
        return {"type": _coding(_DCM, "110100", "Application Activity"), "action": _letter(verb)}
    rest = {"type": _coding(_EVENT_TYPES, "rest", "RESTful Operation")}
    name = {"C": "create", "D": "delete"}.get(_letter(verb))
    if name is None:
        return {**rest, "subtype": [_coding(_RESTFUL, "operation", "operation")], "action": "E"}
    claim = {"meta": {"profile": [_CREATE_PROFILE]}} if name == "create" else {}
    return {**claim, **rest, "subtype": [_coding(_RESTFUL, name, name)], "action": _letter(verb)}


def _letter(verb: str) -> str:
    return "C" if verb in _CREATING else "D" if verb in _DELETING else "E"


def _agents(event: AuditEvent, server: str) -> Iterator[Resource]:
    """Yield the client and the server of a request, or the worker or command."""
    who: Resource = {"display": single_line(event.actor_name) or "unknown"}
    if event.actor_key is not None:
        who["identifier"] = {"type": {"text": "prefix of the API key"}, "value": single_line(event.actor_key)}
    if event.actor_kind is not ActorKind.HTTP:
        yield {
            "type": _concept(_DCM, "110150", "Application"),
            "who": who,
            "requestor": event.actor_kind is ActorKind.COMMAND,
        }
        return
    address = single_line(event.address or event.actor_name) or "unknown"
    yield {
        "type": _concept(_DCM, "110153", "Source Role ID"),
        "who": who,
        "requestor": True,
        "network": {"address": address, "type": _IP_ADDRESS},
    }
    yield {
        "type": _concept(_DCM, "110152", "Destination Role ID"),
        "who": {"display": server},
        "requestor": False,
        "network": {"address": server, "type": _MACHINE_NAME},
    }


def _entities(event: AuditEvent) -> Iterator[Resource]:
    detail = {"action": event.action, "sequence": str(event.seq), "sha256": event.hash}
    if event.detail:
        detail["detail"] = single_line(event.detail)
    yield {
        "what": {"identifier": {"type": {"text": event.resource}, "value": single_line(event.subject_id)}},
        "type": _coding(_OBJECT_TYPES, "2", "System Object"),
        "role": _coding(_OBJECT_ROLES, "4", "Domain Resource"),
        "detail": [{"type": name, "valueString": value} for name, value in detail.items()],
    }
    if event.surgery_id is not None and event.surgery_id != event.subject_id:
        yield {
            "what": {"identifier": {"type": {"text": "surgery"}, "value": single_line(event.surgery_id)}},
            "type": _coding(_OBJECT_TYPES, "2", "System Object"),
        }
    if event.request_id is not None:
        yield {
            "what": {"identifier": {"value": single_line(event.request_id)}},
            "type": _coding(_ENTITY_TYPES, "XrequestId", "X-Request-Id"),
        }


def _coding(system: str, code: str, display: str) -> Resource:
    return {"system": system, "code": code, "display": display}


def _concept(system: str, code: str, display: str) -> Resource:
    return {"coding": [_coding(system, code, display)]}
