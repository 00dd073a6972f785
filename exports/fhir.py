"""FHIR R4 Bundle of a surgery: one Observation a number, one DetectedIssue a flag, and the Device that measured.

There is no Patient resource: the subject of each resource is the case number as a logical identifier. docs/codes.md
lists the codes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from hashlib import sha256
from typing import Any
from uuid import NAMESPACE_URL, UUID, uuid5

from contract.flag import Flag
from contract.summary import SummaryStage, SurgerySummary
from exports.codes import (
    COBB,
    COMPONENTS,
    DERIVATIONS,
    ITEMS,
    SCHEME_URI,
    SNOMED,
    SPINE,
    STANDARD_DEVIATION,
    STATUSES,
    UCUM,
    Code,
    definition_code,
    derived_code,
    site,
)
from exports.entries import Entry, entries
from exports.open_ends import beyond
from exports.selection import no_spine_reason, stage_flags
from exports.text import single_line

MEDIA_TYPE = "application/fhir+json"
FILE_SUFFIX = ".fhir.json"

Resource = dict[str, Any]

_COBB_DEFINITIONS = frozenset({"cobb-fixed", "cobb-reselected"})
_ABSENT = "http://terminology.hl7.org/CodeSystem/data-absent-reason"
_STATED = frozenset({"measured", "not_measured"})


def export(summary: SurgerySummary) -> bytes:
    """Return a surgery as a FHIR R4 Bundle of type collection.

    Parameters
    ----------
    summary
        The surgery with all its stages.

    Returns
    -------
    bytes
        UTF-8 JSON. The same summary gives the same bytes. An Observation is ``final`` when its value is measured, and
        ``preliminary`` when it is bracketed, interpolated or assumed, or its curve may go on beyond the measured span;
        one without a value has a dataAbsentReason.
    """
    device = _device(summary)
    resources = [device]
    for stage in summary.stages:
        resources += _of_stage(summary, stage, _url(device))
    bundle: Resource = {
        "resourceType": "Bundle",
        "identifier": {"system": "urn:ietf:rfc3986", "value": f"urn:uuid:{_content_uuid(summary)}"},
        "type": "collection",
        "timestamp": max([summary.created_at, *(stage.created_at for stage in summary.stages)]).isoformat(),
        "entry": [{"fullUrl": _url(resource), "resource": resource} for resource in resources],
    }
    return json.dumps(bundle, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def _content_uuid(summary: SurgerySummary) -> UUID:
    return UUID(bytes=sha256(summary.model_dump_json().encode()).digest()[:16], version=5)


def _uuid(*parts: str | None) -> str:
    return str(uuid5(NAMESPACE_URL, json.dumps(["spinewatch", "fhir", *parts])))


def _url(resource: Resource) -> str:
    return f"urn:uuid:{resource['id']}"


def _concept(code: Code, system: str = SCHEME_URI, text: str | None = None) -> Resource:
    concept: Resource = {"coding": [{"system": system, "code": code.value, "display": code.meaning}]}
    return concept if text is None else {**concept, "text": text}


def _quantity(value: float, unit: str) -> Resource:
    return {"value": value, "unit": unit, "system": UCUM, "code": unit}


def _device(summary: SurgerySummary) -> Resource:
    return {
        "resourceType": "Device",
        "id": _uuid("device", summary.version),
        "deviceName": [{"name": "Spinewatch", "type": "model-name"}],
        "version": [{"value": single_line(summary.version)}],
        "note": [{"text": "Not a medical device; no decision about a patient may rest on it."}],
    }


def _subject(summary: SurgerySummary) -> Resource:
    return {"identifier": {"type": {"text": "case number"}, "value": single_line(summary.reference)}}


def _of_stage(summary: SurgerySummary, stage: SummaryStage, device: str) -> Iterator[Resource]:
    if stage.spine is None:
        reason = no_spine_reason(stage)
        nothing = Entry("spine", "spine", "spine", "", None, None, None, "not_measured", False, reason, ())
        yield _observation(summary, stage, nothing, device)
    else:
        for entry in entries(stage.spine):
            yield _observation(summary, stage, entry, device)
    for number, flag in enumerate(stage_flags(stage)):
        yield _issue(summary, stage, flag, number, device)


def _observation(summary: SurgerySummary, stage: SummaryStage, entry: Entry, device: str) -> Resource:
    sure = entry.status in _STATED and not entry.assumed and (entry.value is None or not entry.open_ends)
    observation: Resource = {
        "resourceType": "Observation",
        "id": _uuid(summary.surgery_id, stage.name, str(stage.take), *entry.identity),
        "status": "final" if sure else "preliminary",
        "code": _code(entry),
        "subject": _subject(summary),
        "issued": stage.created_at.isoformat(),
        "device": {"reference": device},
        "component": [*_components(stage, entry)],
    }
    if stage.captured_at is not None:
        observation["effectiveDateTime"] = stage.captured_at.isoformat()
    if entry.levels:
        observation["bodySite"] = _body_site(entry.levels)
    if entry.code != "spine":
        observation["method"] = _concept(_definition(entry.code))
    if entry.value is None:
        absent = {"system": _ABSENT, "code": "not-performed", "display": "Not Performed"}
        observation["dataAbsentReason"] = {
            "coding": [absent],
            "text": single_line(entry.reason or "not measured"),
        }
    else:
        observation["valueQuantity"] = _quantity(entry.value, entry.unit)
    notes = [*_notes(stage, entry)]
    if notes:
        observation["note"] = [{"text": single_line(note)} for note in notes]
    return observation


def _definition(code: str) -> Code:
    return COMPONENTS.get(code) or definition_code(code)


def _code(entry: Entry) -> Resource:
    """Return what was observed: FHIR has no modifier of a code, so a change or a part of one has a code of its own."""
    if entry.code == "spine":
        return _concept(ITEMS["stereo-spine"])
    text = _definition(entry.code).meaning
    if entry.derivation is not None:
        text = f"{text} ({DERIVATIONS[entry.derivation].meaning})"
    if entry.code in _COBB_DEFINITIONS and entry.derivation is None:
        return _concept(Code(COBB, "Cobb angle"), SNOMED, text)
    return _concept(derived_code(_definition(entry.code), entry.derivation), text=text)


def _body_site(levels: tuple[str, ...]) -> Resource:
    """Return one vertebra, or the vertebral column with the names of the vertebrae: a body site is a single concept."""
    if len(levels) == 1:
        found = site(levels[0])
        return _concept(found.code, found.system)
    return _concept(SPINE, SNOMED, " to ".join((levels[0], levels[-1])))


def _components(stage: SummaryStage, entry: Entry) -> Iterator[Resource]:
    yield _component(ITEMS["stage"], valueString=stage.name)
    if entry.kind == "curve":
        yield _component(ITEMS["curve"], valueString=single_line(entry.subject))
    yield _component(ITEMS["status"], valueCodeableConcept=_concept(STATUSES[entry.status]))
    if entry.derivation is not None:
        yield _component(ITEMS["derivation"], valueCodeableConcept=_concept(DERIVATIONS[entry.derivation]))
    if entry.since is not None:
        yield _component(ITEMS["since"], valueString=entry.since)
    if entry.interval is not None:
        low, high = entry.interval
        yield _component(ITEMS["interval-low"], valueQuantity=_quantity(low, entry.unit))
        yield _component(ITEMS["interval-high"], valueQuantity=_quantity(high, entry.unit))
    if entry.sd is not None:
        name = _concept(Code(STANDARD_DEVIATION, "Standard deviation"), SNOMED)
        yield {"code": name, "valueQuantity": _quantity(entry.sd, entry.unit)}
    levels = [("vertebra", level) for level in entry.levels if len(entry.levels) > 1]
    for item, level in [*levels, *(("open-end", level) for level in entry.open_ends)]:
        found = site(level)
        yield _component(ITEMS[item], valueCodeableConcept=_concept(found.code, found.system))


def _component(name: Code, **value: Any) -> Resource:
    return {"code": _concept(name), **value}


def _notes(stage: SummaryStage, entry: Entry) -> Iterable[str]:
    if entry.assumed:
        yield "It depends on an assumed initial configuration."
    if entry.reason is not None:
        yield f"{_why(entry)}: {entry.reason}."
    if entry.open_ends:
        yield f"{_sentence(beyond(entry.open_ends))}"
    if stage.spine is not None and entry.value is not None:
        yield f"Coordinate system: {stage.spine.frame}."


def _why(entry: Entry) -> str:
    if entry.value is None:
        return "Why it is not measured"
    return "Why it is so" if entry.status == "measured" else "Why it is uncertain"


def _sentence(clause: str) -> str:
    return f"{clause[0].upper()}{clause[1:]}."


def _issue(summary: SurgerySummary, stage: SummaryStage, flag: Flag, number: int, device: str) -> Resource:
    """Return a flag as a DetectedIssue: a named doubt about the results of a stage."""
    return {
        "resourceType": "DetectedIssue",
        "id": _uuid(summary.surgery_id, stage.name, str(stage.take), "flag", flag.code, str(number)),
        "status": "preliminary",
        "code": {"coding": [{"system": SCHEME_URI, "code": flag.code}], "text": flag.code},
        "patient": _subject(summary),
        "identifiedDateTime": stage.created_at.isoformat(),
        "author": {"reference": device},
        "detail": single_line(f"{stage.name}: {flag.detail}"),
    }
