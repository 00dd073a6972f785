"""The document of the DICOM structured report: every number of a surgery, one group per subject and stage.

One document holds all stages, because TID 1502 (time point) and the tracking identifiers of TID 1501 are made for the
same curve at several times; a reader that follows a curve needs no second file. docs/codes.md lists the codes. This
module imports highdicom and is imported only when a report is made.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from typing import Any
from uuid import NAMESPACE_URL, UUID, uuid5

from highdicom import sr
from highdicom.coding_schemes import CodingSchemeIdentificationItem
from pydicom.dataset import Dataset
from pydicom.filewriter import dcmwrite
from pydicom.sr.codedict import codes
from pydicom.sr.coding import Code as ConceptCode
from pydicom.valuerep import DT

from contract.job import FINAL_STATES
from contract.summary import SummaryStage, SurgerySummary
from exports.codes import (
    COBB,
    COMPONENTS,
    DERIVATIONS,
    ITEMS,
    SCHEME,
    SCHEME_UID,
    STATUSES,
    Code,
    definition_code,
    site,
)
from exports.entries import Entry, entries
from exports.selection import no_spine_reason, stage_flags
from exports.text import single_line

_COBB_DEFINITIONS = frozenset({"cobb-fixed", "cobb-reselected"})
_LONG_STRING = 64
_SHORT_STRING = 16
_SR_SERIES = 1
_SECONDARY_CAPTURE = "1.2.840.10008.5.1.4.1.1.7"


def write(summary: SurgerySummary) -> bytes:
    """Return the structured report of a surgery as a DICOM file.

    Parameters
    ----------
    summary
        The surgery, with at least one stage.

    Returns
    -------
    bytes
        The file.
    """
    file = io.BytesIO()
    dcmwrite(file, _document(summary), enforce_file_format=True)
    return file.getvalue()


def _uid(*parts: str) -> str:
    return f"2.25.{uuid5(NAMESPACE_URL, '/'.join(('spinewatch', *parts))).int}"


def _instance_uid(summary: SurgerySummary) -> str:
    """Return a UID of the content: another content under the same SOP Instance UID would be another instance."""
    digest = sha256(summary.model_dump_json().encode()).digest()
    return f"2.25.{UUID(bytes=digest[:16], version=5).int}"


def _patient_id(summary: SurgerySummary) -> str:
    reference = summary.reference
    valid = reference.isprintable() and "\\" not in reference and len(reference.encode()) <= _LONG_STRING
    return reference if valid and reference == reference.strip() else summary.surgery_id


def _document(summary: SurgerySummary) -> Dataset:

    last = max(stage.created_at for stage in summary.stages)
    root = _content(summary)[0]
    items = root.ContentSequence
    # The class copies the content and searches it for images; there are none, so it gets the root alone.
    root.ContentSequence = sr.ContentSequence([])
    report = sr.ComprehensiveSR(
        evidence=[_study(summary)],
        content=root,
        series_instance_uid=_uid(summary.surgery_id, "series"),
        series_number=_SR_SERIES,
        sop_instance_uid=_instance_uid(summary),
        instance_number=1,
        manufacturer="Spinewatch",
        manufacturer_model_name="Spinewatch",
        software_versions=summary.version[:_LONG_STRING],
        series_description="Spine measurements",
        specific_character_set="ISO_IR 192",
        content_date=last.astimezone(UTC).date(),
        content_time=last.astimezone(UTC).time(),
        coding_schemes=[_scheme()],
        is_complete=all(stage.state in FINAL_STATES for stage in summary.stages),
        record_evidence=False,
    )
    # The class takes patient and study from an instance of the study and lists it as evidence; there is none.
    del report.CurrentRequestedProcedureEvidenceSequence
    report.ContentSequence = items
    report.TimezoneOffsetFromUTC = "+0000"
    report.InstanceCreationDate = report.ContentDate
    report.InstanceCreationTime = report.ContentTime
    for equipment in report.ContributingEquipmentSequence:
        equipment.ContributionDateTime = DT(last.astimezone(UTC))
    return report


def _study(summary: SurgerySummary) -> Dataset:
    start = min(_time(stage) for stage in summary.stages).astimezone(UTC)
    study = Dataset()
    study.SpecificCharacterSet = "ISO_IR 192"
    study.PatientID = _patient_id(summary)
    study.PatientName = None
    study.PatientBirthDate = None
    study.PatientSex = None
    study.StudyInstanceUID = _uid(summary.surgery_id, "study")
    study.SeriesInstanceUID = _uid(summary.surgery_id, "none")
    study.SOPInstanceUID = _uid(summary.surgery_id, "none")
    study.SOPClassUID = _SECONDARY_CAPTURE
    study.AccessionNumber = None
    study.StudyID = summary.surgery_id[:_SHORT_STRING]
    study.StudyDate = start.strftime("%Y%m%d")
    study.StudyTime = start.strftime("%H%M%S")
    study.ReferringPhysicianName = None
    return study


def _time(stage: SummaryStage) -> datetime:
    return stage.captured_at or stage.created_at


def _scheme() -> CodingSchemeIdentificationItem:

    scheme = CodingSchemeIdentificationItem(designator=SCHEME, name="Spinewatch, docs/codes.md")
    scheme.CodingSchemeUID = SCHEME_UID
    return scheme


@cache
def _concept(code: Code, scheme: str = SCHEME) -> sr.CodedConcept:
    """Return a concept; a document has few, each in many places, and they are not changed."""
    return sr.CodedConcept(code.value, scheme, code.meaning)


def _content(summary: SurgerySummary) -> sr.MeasurementReport:

    observer = sr.ObserverContext(
        observer_type=codes.DCM.Device,
        observer_identifying_attributes=sr.DeviceObserverIdentifyingAttributes(
            uid=_uid("device", summary.version), name="Spinewatch", model_name=f"Spinewatch {summary.version}"
        ),
    )
    groups = [
        group for order, stage in enumerate(summary.stages, 1) for group in _groups(summary, stage, order)
    ]
    return sr.MeasurementReport(
        observation_context=sr.ObservationContext(observer_device_context=observer),
        procedure_reported=_concept(ITEMS["stereo-spine"]),
        imaging_measurements=groups,
    )


def _groups(
    summary: SurgerySummary, stage: SummaryStage, order: int
) -> Iterator[sr.MeasurementsAndQualitativeEvaluations]:
    """Yield the groups of a stage: of the spine, which also holds flags and frame, then of its curves and vertebrae."""
    flags = [("flag", f"{flag.code}: {flag.detail}") for flag in stage_flags(stage)]
    if stage.spine is None:
        reason = ("reason", no_spine_reason(stage))
        yield _group(summary, stage, order, ("spine", "spine"), (), [reason, *flags])
        return
    subjects: dict[tuple[str, str], list[Entry]] = {("spine", "spine"): []}
    for entry in entries(stage.spine):
        subjects.setdefault((entry.kind, entry.subject), []).append(entry)
    texts = [("frame", stage.spine.frame), ("reference-line", stage.spine.reference_line), *flags]
    sites = {curve.name: curve.vertebrae for curve in stage.spine.curves}
    for (kind, name), members in subjects.items():
        levels = sites.get(name, (name,) if kind == "vertebra" else ())
        yield _group(
            summary,
            stage,
            order,
            (kind, name),
            levels,
            texts if kind == "spine" else (),
            measurements=members,
        )


def _group(
    summary: SurgerySummary,
    stage: SummaryStage,
    order: int,
    subject: tuple[str, str],
    levels: Iterable[str],
    texts: Iterable[tuple[str, str]],
    measurements: Sequence[Entry] = (),
) -> sr.MeasurementsAndQualitativeEvaluations:

    kind, name = subject
    group = sr.MeasurementsAndQualitativeEvaluations(
        tracking_identifier=sr.TrackingIdentifier(
            uid=_uid(summary.surgery_id, "tracking", kind, name), identifier=name
        ),
        time_point_context=sr.TimePointContext(time_point=stage.name, time_point_order=order),
        finding_type=_concept(ITEMS[kind]),
        algorithm_id=sr.AlgorithmIdentification("Spinewatch", stage.version or summary.version),
        finding_sites=[_site(level) for level in levels],
        measurements=[_measurement(entry, entry.value) for entry in measurements if entry.value is not None],
    )
    content = group[0].ContentSequence
    for entry in measurements:
        if entry.value is None:
            content.append(_absent(entry))
    for item, text in texts:
        content.append(_text(item, text, "CONTAINS"))
    return group


def _text(item: str, text: str, relationship: str) -> sr.TextContentItem:

    return sr.TextContentItem(_concept(ITEMS[item]), single_line(text), relationship)


def _code(item: str, code: Code, relationship: str) -> sr.CodeContentItem:

    return sr.CodeContentItem(_concept(ITEMS[item]), _concept(code), relationship)


def _site(level: str) -> sr.FindingSite:

    found = site(level)
    return sr.FindingSite(_concept(found.code, found.designator))


def _name(entry: Entry) -> sr.CodedConcept:
    if entry.code in _COBB_DEFINITIONS:
        return _concept(Code(COBB, "Cobb angle"), "SCT")
    return _concept(COMPONENTS.get(entry.code) or definition_code(entry.code))


def _unit(unit: str) -> sr.CodedConcept:
    return _concept(Code(unit, {"deg": "degree", "mm": "millimeter"}.get(unit, unit)), "UCUM")


def _properties(entry: Entry) -> Iterator[Any]:
    """Yield status, reason, open ends and stage of comparison as properties of a value."""
    if entry.status != "measured":
        yield _code("status", STATUSES[entry.status], "HAS PROPERTIES")
    if entry.assumed and entry.status != "assumed":
        yield _code("assumed", STATUSES["assumed"], "HAS PROPERTIES")
    if entry.reason is not None:
        yield _text("reason", entry.reason, "HAS PROPERTIES")
    for level in entry.open_ends:
        found = site(level)
        end = _concept(found.code, found.designator)
        yield sr.CodeContentItem(_concept(ITEMS["open-end"]), end, "HAS PROPERTIES")
    if entry.since is not None:
        yield _text("since", entry.since, "HAS PROPERTIES")


def _modifiers(entry: Entry) -> Iterator[sr.CodeContentItem]:
    """Yield the method, where the name does not say it already, and the derivation."""
    if entry.code in _COBB_DEFINITIONS:
        yield sr.CodeContentItem(
            codes.SCT.MeasurementMethod, _concept(definition_code(entry.code)), "HAS CONCEPT MOD"
        )
    if entry.derivation is not None:
        yield sr.CodeContentItem(
            codes.DCM.Derivation, _concept(DERIVATIONS[entry.derivation]), "HAS CONCEPT MOD"
        )


def _sites(entry: Entry) -> list[sr.FindingSite]:
    """Return the vertebrae of a number, where they are not those of its group already."""
    return [] if entry.kind == "vertebra" else [_site(level) for level in entry.levels]


def _measurement(entry: Entry, value: float) -> sr.Measurement:
    unit = _unit(entry.unit)
    measurement = sr.Measurement(_name(entry), value, unit)
    content: list[sr.ContentItem] = [*_modifiers(entry), *_sites(entry)]
    for name, width in _uncertainty(entry, value).items():
        content.append(sr.NumContentItem(name, width, unit, relationship_type="HAS PROPERTIES"))
    content += _properties(entry)
    if content:
        measurement[0].ContentSequence = sr.ContentSequence(content)
    return measurement


def _uncertainty(entry: Entry, value: float) -> dict[ConceptCode, float]:
    """Return how far the 95% interval reaches above and below the value, and the standard deviation."""
    found = {}
    if entry.interval is not None:
        low, high = entry.interval
        found[codes.SCT.RangeOfUpperMeasurementUncertainty] = high - value
        found[codes.SCT.RangeOfLowerMeasurementUncertainty] = value - low
    if entry.sd is not None:
        found[codes.SCT.StandardDeviation] = entry.sd
    return found


def _absent(entry: Entry) -> sr.CodeContentItem:
    item = sr.CodeContentItem(_name(entry), _concept(STATUSES["not_measured"]), "CONTAINS")
    properties = [*_modifiers(entry), *_sites(entry), *_properties(entry)]
    item.ContentSequence = sr.ContentSequence(properties)
    return item
