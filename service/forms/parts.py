"""The parts of a multipart form, before they are compared with a schema: each once, files with a name, clean text."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile

from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.problems import InvalidInputError
from spinewatch.errors import SpinewatchError

_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
_SHORT = 16 * 1024
"""Characters of text that are checked sooner than another thread begins."""


class PartError(SpinewatchError):
    """A part of a form cannot be used, whatever its content."""

    code = "invalid-part"


async def check_parts(request: Request) -> None:
    """Raise ``InvalidInputError`` for a part given twice, a file without a name, or text with control characters."""
    route: DeclaredRoute | None = request.scope.get(SCOPE_KEY)
    if route is None:
        return
    parts = (await request.form()).multi_items()
    if sum(len(value) for _, value in parts if isinstance(value, str)) > _SHORT:
        await run_in_threadpool(_check, route, parts)  # megabytes of text would hold all other requests
    else:
        _check(route, parts)


def _check(route: DeclaredRoute, parts: Sequence[tuple[str, UploadFile | str]]) -> None:
    for name, count in Counter(name for name, _ in parts).items():
        if count > 1 and name in route.single_parts:
            raise _error(name, "the part is given twice; send it once")
    for name, value in parts:
        if not isinstance(value, str):
            continue
        if name in route.file_parts:
            raise _error(
                name,
                "the part has no filename and was read as text; send it as a file: filename=, not filename* alone",
            )
        if _CONTROL.search(value):
            raise _error(
                name, "the part is not plain text in UTF-8; remove control characters, or send it as a file"
            )


def _error(name: str, problem: str) -> InvalidInputError:
    return InvalidInputError(name, PartError(problem))
