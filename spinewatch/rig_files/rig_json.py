"""The rig JSON, the interchange format of calibrated cameras (docs/method.md), and its validation."""

from __future__ import annotations

import json
import math
import unicodedata
from collections import Counter
from collections.abc import Mapping
from typing import Any

from spinewatch.camera import Camera, Rig
from spinewatch.errors import RigError
from spinewatch.rig_plausibility import SIDES, check_plausible_rig

_LENGTHS = {
    "position_mm": 3,
    "rotation_deg": 3,
    "principal_point_mm": 2,
    "radial": 2,
    "decentering": 2,
    "image_size_px": 2,
    "pixel_size_mm": 2,
}
_MAX_NUMBER = 1e9
_MAX_IMAGE_PX = 100_000
_MAX_NAME = 200


def parse_rig(text: str | bytes) -> Rig:
    """Return the rig of a JSON text.

    Parameters
    ----------
    text
        JSON, as text or in UTF-8; a byte-order mark is ignored.

    Returns
    -------
    Rig
        The rig.

    Raises
    ------
    RigError
        If the text is not JSON or not a rig; names the first field that is wrong.
    """
    return rig_from_dict(decode_json(text))


def decode_json(text: str | bytes) -> object:
    """Return the decoded JSON text of a rig, in which no field may be given twice.

    Parameters
    ----------
    text
        JSON, as text or in UTF-8; a byte-order mark is ignored.

    Returns
    -------
    object
        The decoded document.

    Raises
    ------
    RigError
        If the text is not JSON, or an object in it has a field twice; names that field with its path.

    Examples
    --------
    >>> decode_json('{"left": {"radial": [0, 0], "radial": [0.003, 0]}}')
    Traceback (most recent call last):
    spinewatch.errors.RigError: rig field 'left.radial' is given twice; keep one
    """
    try:
        marked = text.removeprefix("\ufeff") if isinstance(text, str) else text
        document = json.loads(marked, object_pairs_hook=_Object)
        repeated = _repeated(document)
    except (ValueError, UnicodeDecodeError, RecursionError) as error:
        raise RigError("(document)", "is not JSON; export the rig again") from error
    if repeated is not None:
        raise RigError(repeated, "is given twice; keep one")
    return document


def rig_from_dict(document: object) -> Rig:
    """Return the rig of a decoded JSON object. This is the validation of every rig that enters the system.

    Parameters
    ----------
    document
        The decoded object.

    Returns
    -------
    Rig
        The rig.

    Raises
    ------
    RigError
        If it is not a rig; names the first field that is missing, unknown, not finite or implausible
        (`spinewatch.rig_plausibility`).

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> document = rig_to_dict(large_rig())
    >>> rig_to_dict(rig_from_dict(document)) == document
    True
    >>> document["left"]["focal_length_mm"] = -7.7
    >>> rig_from_dict(document)
    Traceback (most recent call last):
    spinewatch.errors.RigError: rig field 'left.focal_length_mm' must be positive
    """
    if not isinstance(document, Mapping):
        raise RigError("(document)", "must be an object with name, left and right")
    unknown = set(document) - {"name", *SIDES}
    if unknown:
        raise RigError(sorted(map(str, unknown))[0], "is not a field of a rig; remove it")
    name = document.get("name")
    if not isinstance(name, str) or not name.strip():
        raise RigError("name", "must be a non-empty string")
    if any(unicodedata.category(character) in {"Cc", "Cs"} for character in name):
        raise RigError("name", "must not contain control characters or lone surrogates")
    if len(name) > _MAX_NAME:
        raise RigError("name", f"has {len(name)} characters; at most {_MAX_NAME} are allowed")
    left, right = (_camera(document, side) for side in SIDES)
    if left.position_mm == right.position_mm:
        raise RigError("right.position_mm", "equals left.position_mm; two cameras need a baseline")
    rig = Rig(name=name, left=left, right=right)
    check_plausible_rig(rig)
    return rig


def rig_to_dict(rig: Rig) -> dict[str, Any]:
    """Return the JSON object of a rig.

    Parameters
    ----------
    rig
        The rig.

    Returns
    -------
    dict
        The object, from which `rig_from_dict` returns exactly the same rig.
    """
    return {"name": rig.name, **{side: camera_to_dict(getattr(rig, side)) for side in SIDES}}


def camera_to_dict(camera: Camera) -> dict[str, Any]:
    """Return the JSON object of one camera of a rig.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    dict
        The object.
    """
    return {
        "position_mm": list(camera.position_mm),
        "rotation_deg": list(camera.rotation_deg),
        "focal_length_mm": camera.focal_length_mm,
        "principal_point_mm": list(camera.principal_point_mm),
        "radial": list(camera.radial),
        "decentering": list(camera.decentering),
        "image_size_px": list(camera.image_size_px),
        "pixel_size_mm": list(camera.pixel_size_mm),
    }


class _Object(dict[str, Any]):
    """A JSON object that remembers a key given twice."""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        counts = Counter(key for key, _ in pairs) if len(self) < len(pairs) else Counter[str]()
        self.repeated = next((key for key, count in counts.items() if count > 1), None)


def _repeated(value: object, path: str = "") -> str | None:
    """Return the path of the first key given twice in a decoded document, or None."""
    if isinstance(value, _Object) and value.repeated is not None:
        return f"{path}{value.repeated}"
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = (_repeated(item, f"{path}{key}.") for key, item in items)
    return next((repeated for repeated in found if repeated is not None), None)


def _camera(document: Mapping[str, Any], side: str) -> Camera:
    entry = document.get(side)
    if not isinstance(entry, Mapping):
        raise RigError(side, "is missing; a rig has a left and a right camera")
    unknown = set(entry) - {*_LENGTHS, "focal_length_mm"}
    if unknown:
        raise RigError(f"{side}.{sorted(map(str, unknown))[0]}", "is not a field of a camera; remove it")
    values = {key: _numbers(entry, side, key, n) for key, n in _LENGTHS.items()}
    (focal,) = _numbers({"focal_length_mm": [entry.get("focal_length_mm")]}, side, "focal_length_mm", 1)
    width, height = values["image_size_px"]
    if width != int(width) or height != int(height) or min(width, height) < 1:
        raise RigError(f"{side}.image_size_px", "must be two positive whole numbers")
    if max(width, height) > _MAX_IMAGE_PX:
        raise RigError(f"{side}.image_size_px", f"must be at most {_MAX_IMAGE_PX}")
    if focal <= 0:
        raise RigError(f"{side}.focal_length_mm", "must be positive")
    if min(values["pixel_size_mm"]) <= 0:
        raise RigError(f"{side}.pixel_size_mm", "must be positive")
    return Camera(
        position_mm=_triple(values["position_mm"]),
        rotation_deg=_triple(values["rotation_deg"]),
        focal_length_mm=focal,
        principal_point_mm=_pair(values["principal_point_mm"]),
        radial=_pair(values["radial"]),
        decentering=_pair(values["decentering"]),
        image_size_px=(int(width), int(height)),
        pixel_size_mm=_pair(values["pixel_size_mm"]),
    )


def _numbers(entry: Mapping[str, Any], side: str, key: str, count: int) -> list[float]:
    field, value = f"{side}.{key}", entry.get(key)
    if value is None or value == [None]:
        raise RigError(field, "is missing")
    if not isinstance(value, list | tuple) or len(value) != count:
        raise RigError(field, f"must be a list of {count} numbers")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float):
            raise RigError(field, "must contain only numbers")
    numbers = [_float(item) for item in value]
    if not all(map(math.isfinite, numbers)):
        raise RigError(field, "must be finite")
    if max(map(abs, numbers)) > _MAX_NUMBER:
        raise RigError(field, f"has a number beyond {_MAX_NUMBER:g}; check its unit")
    return numbers


def _float(number: float) -> float:
    """Return a number in double precision; infinity for an integer that is too large."""
    try:
        return float(number)
    except OverflowError:
        return math.inf


def _pair(values: list[float]) -> tuple[float, float]:
    a, b = values
    return a, b


def _triple(values: list[float]) -> tuple[float, float, float]:
    a, b, c = values
    return a, b, c
