"""Fixed limits of requests, and the largest body of each route; docs/operations.md lists them."""

from __future__ import annotations

from service.declared_routes import DeclaredRoute
from settings import Settings

MAX_HEAD_BYTES = 16 * 1024
"""Request line and headers together."""
MAX_TARGET_BYTES = 4096
"""Path and query of a request line."""
MAX_HEADERS = 100
MAX_QUERY_PARAMETERS = 50
MAX_JSON_VALUES = 5_000
"""Values of a JSON document: objects, arrays, texts, numbers."""
MAX_JSON_DEPTH = 32
MAX_JSON_DIGITS = 64
"""Characters of one number."""
MAX_TEXT_PART_BYTES = 128 * 1024
"""Bytes of a part of a form that is no file."""
MAX_ERRORS = 20
"""Entries in the errors of one problem."""
MIN_BODY_RATE = 16 * 1024
"""Bytes per second that extend the time for a body by one second."""

_DOCUMENTS = frozenset(
    {
        "/v1/calibrations",
        "/v1/surgeries/{surgery_id}/spine",
        "/v1/surgeries/{surgery_id}/spine/initial",
        "/v1/surgeries/{surgery_id}/radiographs/fit",
    }
)
"""Routes that take a rig, or a spine with its landmarks."""


def max_body_bytes(route: DeclaredRoute | None, settings: Settings) -> int:
    """Return the largest body of a request; ``route`` is None where no route matches."""
    if route is not None and route.media_type == "multipart/form-data":
        return settings.max_upload_bytes
    if route is not None and route.path in _DOCUMENTS:
        return settings.max_document_bytes
    return settings.max_json_bytes
