"""Markups of 3D Slicer (.mrk.json, schema v1.0.3): centroids, end plates and Cobb angles of every stage.

Coordinates are LPS, mm: left, posterior and superior of the spine's frame. Per stage there is a point list ``STAGE
vertebrae`` with every centroid, which carries all measures; per curve the superior end plate of its upper end vertebra
and the inferior one of its lower end vertebra as lines, and the Cobb angle as an angle between the normals of the two,
drawn in the coronal plane at the apex, or between end vertebrae that are neighbours. End plates have nominal sizes;
only their directions are measured.

References
----------
Slicer, Modules/Loadable/Markups/Resources/Schema, markups-schema-v1.0.3.json. ``quantityCode``, ``methodCode``
(the definition) and ``units`` are DICOM coded entries: code value, coding scheme designator, code meaning.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from contract.spine import Curve, MeasureValue, StageSpine, VertebraState
from contract.summary import SummaryStage, SurgerySummary
from exports.codes import COBB, SCHEME, Code, definition_code
from exports.coordinates import LPS_FROM_PATIENT, point
from exports.open_ends import beyond, open_ends
from exports.selection import no_spine_reason, selected_stages
from exports.text import single_line
from exports.vertebra_size import body_size_mm
from spinewatch.arrays import Float
from spinewatch.spine.configuration import Origin

MEDIA_TYPE = "application/json"
FILE_SUFFIX = ".mrk.json"
SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)

_COBB_DEFINITIONS = frozenset({"cobb-fixed", "cobb-reselected"})
_UNIT_CODES = {"deg": ["deg", "UCUM", "degree"], "mm": ["mm", "UCUM", "millimeter"]}
_ARM_MM = 60.0
_COLOURS = {
    Origin.MEASURED: [0.0, 0.447, 0.698],
    Origin.INTERPOLATED: [0.902, 0.624, 0.0],
    Origin.ASSUMED: [0.8, 0.475, 0.655],
    Origin.NOT_MEASURED: [0.5, 0.5, 0.5],
}

Document = dict[str, Any]
_OpenEnds = Mapping[str, Sequence[str]]


def export(summary: SurgerySummary, stage: str | None = None) -> bytes:
    """Return the markups of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    stage
        Name of one stage; None for all.

    Returns
    -------
    bytes
        JSON, UTF-8; a stage without a spine has a point list whose one point has no position and says why.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    markups = [
        markup
        for found in selected_stages(summary, stage)
        for markup in (_of_stage(found.spine) if found.spine is not None else [_without_spine(found)])
    ]
    document = {"@schema": SCHEMA, "markups": markups}
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _of_stage(spine: StageSpine) -> Iterator[Document]:
    states = {state.vertebra: state for state in spine.vertebrae}
    ends = open_ends(spine)
    yield _centroids(spine, ends)
    for curve in spine.curves:
        upper, lower = states.get(curve.upper), states.get(curve.lower)
        if upper is not None and upper.position_mm is not None:
            yield _end_plate(spine, curve, upper, 1)
        if lower is not None and lower.position_mm is not None:
            yield _end_plate(spine, curve, lower, -1)
        angle = _cobb_angle(spine, curve, states, ends)
        if angle is not None:
            yield angle


def _without_spine(stage: SummaryStage) -> Document:
    nowhere = _control_point(1, "no spine", None, single_line(no_spine_reason(stage)))
    return _markup("Fiducial", f"{stage.name} has no spine", [nowhere], [])


def _centroids(spine: StageSpine, ends: _OpenEnds) -> Document:
    points = [
        _control_point(number, state.vertebra, state.position_mm, _about(state))
        for number, state in enumerate(spine.vertebrae, start=1)
    ]
    return _markup(
        "Fiducial",
        f"{spine.stage} vertebrae",
        points,
        [_measurement(value, ends) for value in spine.measures],
    )


def _end_plate(spine: StageSpine, curve: Curve, state: VertebraState, side: int) -> Document:
    _, width, height = body_size_mm(state.vertebra)
    R = np.array(state.rotation)
    centre = np.array(state.position_mm) + side * height / 2 * R[:, 2]
    ends = [centre + half * width * R[:, 1] for half in (-0.5, 0.5)]
    name = "superior" if side > 0 else "inferior"
    about = f"{name} end plate, nominal size; {_about(state)}"
    points = [
        _control_point(number, f"{state.vertebra} {where}", end.tolist(), about)
        for number, (where, end) in enumerate(zip(("right", "left"), ends, strict=True), start=1)
    ]
    title = f"{spine.stage} {single_line(curve.name)} {name} end plate {state.vertebra}"
    return _markup("Line", title, points, [], _COLOURS[state.origin])


def _cobb_angle(
    spine: StageSpine, curve: Curve, states: Mapping[str, VertebraState], ends: _OpenEnds
) -> Document | None:
    between = [states.get(level) for level in (curve.upper, curve.lower)]
    normals = [_coronal_normal(state) for state in between if state is not None]
    middle = [states.get(curve.apex)] if curve.apex is not None else between
    known = [state.position_mm for state in middle if state is not None and state.position_mm is not None]
    if len(normals) != 2 or len(known) != len(middle):
        return None
    upper, lower = normals
    if upper is None or lower is None:
        return None
    vertex = np.mean(known, axis=0)
    places = [vertex + _ARM_MM * upper, vertex, vertex + _ARM_MM * lower]
    labels = [f"{curve.upper} normal", "Cobb", f"{curve.lower} normal"]
    points = [
        _control_point(number, label, place.tolist(), "normal of the end plate in the coronal plane")
        for number, (label, place) in enumerate(zip(labels, places, strict=True), start=1)
    ]
    values = [
        _measurement(value, ends)
        for value in spine.measures
        if value.definition in _COBB_DEFINITIONS and value.curve == curve.name
    ]
    return _markup("Angle", f"{spine.stage} {single_line(curve.name)} Cobb", points, values)


def _coronal_normal(state: VertebraState) -> Float | None:
    """Return the unit normal of the end plates as the coronal plane shows it, patient axes."""
    if state.rotation is None:
        return None
    normal = np.array(state.rotation)[:, 2] * [0.0, 1.0, 1.0]
    length = float(np.linalg.norm(normal))
    return normal / length if length > 0 else None


def _about(state: VertebraState) -> str:
    words = state.origin.value.replace("_", " ")
    if state.position_sd_mm is not None:
        anterior, left, cephalad = state.position_sd_mm
        words += f"; sd anterior {anterior:.2f}, left {left:.2f}, cephalad {cephalad:.2f} mm"
    reason = state.reason or state.position_reason
    return words if reason is None else f"{words}: {single_line(reason)}"


def _control_point(number: int, label: str, position_mm: list[float] | None, description: str) -> Document:
    base: Document = {
        "id": str(number),
        "label": label,
        "description": description,
        "associatedNodeID": "",
        "selected": True,
        "locked": True,
        "visibility": position_mm is not None,
    }
    if position_mm is None:
        return {**base, "positionStatus": "undefined"}
    place = point(LPS_FROM_PATIENT, np.array(position_mm))
    return {**base, "position": place.tolist(), "positionStatus": "defined"}


def _measurement(value: MeasureValue, ends: _OpenEnds) -> Document:
    method = _coded(definition_code(value.definition))
    cobb = value.definition in _COBB_DEFINITIONS
    place = " ".join(filter(None, (value.curve and single_line(value.curve), "-".join(value.levels))))
    document: Document = {
        "name": f"{single_line(value.definition)} {place}".strip(),
        "enabled": value.value is not None,
        "units": _UNIT_CODES.get(value.unit, single_line(value.unit)),
        "description": _qualification(value, ends.get(value.curve or "", ())),
        "quantityCode": [COBB, "SCT", "Cobb angle"] if cobb else method,
        "methodCode": method,
    }
    return document if value.value is None else {**document, "value": value.value}


def _coded(code: Code) -> list[str]:
    return [single_line(code.value) or "unknown", SCHEME, single_line(code.meaning) or "unknown"]


def _qualification(value: MeasureValue, beyond_these: Sequence[str]) -> str:
    words = [f"definition {single_line(value.definition)}", f"status {value.status.value.replace('_', ' ')}"]
    if value.sd is not None:
        words.append(f"sd {value.sd:.2f} {single_line(value.unit)}")
    if value.interval is not None and None not in value.interval:
        words.append(f"95% interval {value.interval[0]:.2f} to {value.interval[1]:.2f}")
    if value.assumed:
        words.append("depends on an assumed initial configuration")
    if value.reason is not None:
        words.append(single_line(value.reason))
    if beyond_these:
        words.append(beyond(beyond_these))
    return "; ".join(words)


def _markup(
    kind: str,
    name: str,
    points: list[Document],
    measurements: list[Document],
    colour: list[float] | None = None,
) -> Document:
    shade = colour or _COLOURS[Origin.MEASURED]
    return {
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": True,
        "fixedNumberOfControlPoints": True,
        "labelFormat": "%N-%d",
        "lastUsedControlPointNumber": len(points),
        "controlPoints": points,
        "measurements": measurements,
        "display": {"visibility": True, "opacity": 1.0, "selectedColor": shade},
    }
