"""The scopes that each route needs; a route that is not in the table needs ``admin``."""

from __future__ import annotations

from collections.abc import Mapping

from contract.key import Scope

Needed = frozenset[Scope]
"""The scopes of which a key needs one; none for a route that is answered without a key too."""

UNDECLARED: Needed = frozenset({Scope.ADMIN})
"""What a route needs that is not in the table."""

_ANONYMOUS: Needed = frozenset()
_ANY: Needed = frozenset(Scope)
_READ = frozenset({Scope.STAGE_READ})
_CAPTURE = frozenset({Scope.CAPTURE_WRITE})
_CORRECT = frozenset({Scope.CORRECT_WRITE})
_CAPTURED = _CAPTURE | _READ
"""What a cart has to see of what it sends."""
_ADMIN = frozenset({Scope.ADMIN})

_CALIBRATION = "/v1/calibrations/{calibration_id}"
_SURGERY = "/v1/surgeries/{surgery_id}"
_STAGE = _SURGERY + "/stages/{name}"
_RADIOGRAPH = _SURGERY + "/radiographs/{radiograph_id}"

SCOPES: Mapping[str, Needed] = {
    "POST /v1/calibrations": _CAPTURE,
    "POST /v1/calibrations/from-images": _CAPTURE,
    "GET /v1/calibrations": _CAPTURED,
    f"GET {_CALIBRATION}": _CAPTURED,
    f"GET {_CALIBRATION}/report": _CAPTURED,
    f"GET {_CALIBRATION}/shots/{{number}}/images/{{side}}": _READ,
    f"GET {_CALIBRATION}/checks": _CAPTURED,
    f"GET {_CALIBRATION}/points": _CAPTURED,
    "POST /v1/surgeries": _CAPTURE,
    "GET /v1/surgeries": _READ,
    f"GET {_SURGERY}": _READ,
    f"POST {_SURGERY}/stages": _CAPTURE,
    f"GET {_SURGERY}/stages": _READ,
    f"GET {_STAGE}": _CAPTURED,
    f"GET {_STAGE}/triads": _READ,
    f"GET {_STAGE}/takes": _READ,
    f"POST {_STAGE}/revisions": _CORRECT,
    f"GET {_STAGE}/burst": _READ,
    f"GET {_STAGE}/features": _READ,
    f"GET {_STAGE}/candidates": _READ,
    f"GET {_STAGE}/images/{{side}}": _READ,
    f"GET {_STAGE}/spine": _READ,
    f"GET {_STAGE}/measures": _READ,
    f"GET {_SURGERY}/motion": _READ,
    f"GET {_SURGERY}/motion/legacy-1995": _READ,
    f"GET {_SURGERY}/summary": _READ,
    f"GET {_SURGERY}/exports/{{format}}": _READ,
    f"POST {_SURGERY}/radiographs": _CAPTURE,
    f"GET {_SURGERY}/radiographs": _READ,
    f"POST {_SURGERY}/radiographs/fit": _CORRECT,
    f"GET {_RADIOGRAPH}": _READ,
    f"GET {_RADIOGRAPH}/image": _READ,
    f"PUT {_SURGERY}/spine": _CORRECT,
    f"PUT {_SURGERY}/spine/initial": _CORRECT,
    f"GET {_SURGERY}/spine": _READ,
    f"GET {_SURGERY}/spine/revisions": _READ,
    f"POST {_SURGERY}/spine/rebaselines": _CORRECT,
    f"POST {_SURGERY}/spine/computations": _CORRECT,
    "GET /v1/measure-definitions": _READ,
    "GET /v1/plans/accuracy": _CAPTURED,
    "GET /v1/plans/disparity": _CAPTURED,
    "GET /v1/plans/control-field": _CAPTURED,
    "GET /v1/jobs/{job_id}": _CAPTURED,
    "GET /v1/jobs": _CAPTURED,
    "GET /v1/changes": _READ,
    "GET /v1/events": _READ,
    "POST /v1/jobs/{job_id}/cancel": _CAPTURE,
    "GET /v1/health": _ANONYMOUS,
    "GET /health/live": _ANONYMOUS,
    "GET /health/ready": _ANY,
    "GET /metrics": _ANY,
    "GET /v1/session": _ANY,
    "POST /v1/session": _ANY,
    "DELETE /v1/session": _ANY,
    "GET /v1/keys": _ADMIN,
    "POST /v1/keys": _ADMIN,
    "GET /v1/keys/{prefix}": _ADMIN,
    "DELETE /v1/keys/{prefix}": _ADMIN,
    "GET /v1/audit": _ADMIN,
    f"DELETE {_SURGERY}": _ADMIN,
}
"""The scopes that each method and path needs."""

OPEN_PATHS = frozenset({"/", "/icon.svg", "/docs", "/docs/oauth2-redirect", "/openapi.json", "/health/live"})
"""Paths that contain no data: liveness, the dashboard and the pages of the API, which are the same everywhere."""

OPEN_FOLDERS = ("/assets/", "/docs/assets/")
"""Folders of files that contain no data."""


def is_open(method: str, path: str) -> bool:
    """Return whether a request is answered without any look at keys."""
    return method in {"GET", "HEAD"} and (path in OPEN_PATHS or path.startswith(OPEN_FOLDERS))


def needed_scopes(method: str, template: str | None) -> Needed:
    """Return what a request needs; ``template`` is the declared path of its route, None when there is no route."""
    if template is None:
        return _ANY
    return SCOPES.get(f"{'GET' if method == 'HEAD' else method} {template}", UNDECLARED)
