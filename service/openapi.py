"""The OpenAPI document: ``python -m service.openapi`` writes openapi/openapi.json, ``--check`` compares it."""

from __future__ import annotations

import argparse
import json
import sys
from math import inf
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.responses import JSONResponse
from starlette.routing import Route

from service.openapi_access import declare_access
from service.problems import MEDIA_TYPE
from service.shared_run import SharedRun

CONTRACT = Path(__file__).parent.parent / "openapi" / "openapi.json"

_FIRST_ERROR = 400
_FRAMEWORK_ERROR = {"$ref": "#/components/schemas/HTTPValidationError"}


def install(app: FastAPI) -> None:
    """Declare application/problem+json for all problems in the OpenAPI document of an application.

    It is made when it is first asked for: that takes 0.7 s, in a thread, for which no start should wait. However many
    ask for it together, it is made once: what two threads make at the same time is neither's document.
    """
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = generate()
            _declare_problems(document)
            declare_access(document)
        return generate()

    def render() -> bytes:
        content = JSONResponse(app.openapi()).body
        app.openapi_schema = None  # many objects, which every full collection would visit
        return bytes(content)

    rendered = SharedRun(render, kept_seconds=inf)

    async def respond(_: Request) -> Response:
        return Response(await rendered.result(), media_type="application/json")

    app.openapi = openapi  # type: ignore[method-assign]
    app.router.routes.insert(0, Route(str(app.openapi_url), respond, include_in_schema=False))


def text(app: FastAPI) -> str:
    """Return the OpenAPI document of an application as it is committed."""
    return json.dumps(app.openapi(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


def _declare_problems(document: dict[str, Any]) -> None:
    for path, operation in (
        (path, operation) for path, methods in document["paths"].items() for operation in methods.values()
    ):
        responses = operation["responses"]
        if "{surgery_id}" in path:
            responses["410"] = {**responses["500"], "description": "Gone"}
        for status in [status for status in responses if int(status) >= _FIRST_ERROR]:
            (content,) = responses[status]["content"].values()
            schema = content["schema"]
            if schema == _FRAMEWORK_ERROR:  # FastAPI adds it to every route with a parameter, valid or not
                del responses[status]
            else:
                responses[status]["content"] = {MEDIA_TYPE: {"schema": schema}}
    for name in ("HTTPValidationError", "ValidationError"):
        document["components"]["schemas"].pop(name, None)


def main() -> int:
    """Write or check the committed document; return the exit status."""
    from service.app import create_app  # noqa: PLC0415 - service.app imports this module
    from settings import Settings  # noqa: PLC0415

    parser = argparse.ArgumentParser(description="Write openapi/openapi.json, or check that it is current.")
    parser.add_argument("--check", action="store_true", help="compare only; exit status 1 if they differ")
    current = text(create_app(Settings()))
    if not parser.parse_args().check:
        CONTRACT.parent.mkdir(exist_ok=True)
        CONTRACT.write_text(current, encoding="utf-8")
        return 0
    if CONTRACT.exists() and CONTRACT.read_text(encoding="utf-8") == current:
        return 0
    sys.stderr.write("openapi/openapi.json is not current; run: python -m service.openapi\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
