"""What each route declares of a request: methods, query parameters, and the media type and parts of its body."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, get_args, get_origin

from fastapi import UploadFile
from fastapi.dependencies.models import Dependant
from fastapi.params import Form
from fastapi.routing import APIRoute
from pydantic.fields import FieldInfo
from starlette.routing import BaseRoute

SCOPE_KEY = "spinewatch.route"
"""Key of a request's scope under which its ``DeclaredRoute`` lies."""

CONTROL = re.compile("[\x00-\x1f\x7f]")
"""A control character: no identifier has one, and PostgreSQL refuses a text with NUL."""

_KEPT_PATHS = 64
"""Paths whose routes are kept; a path is at most as long as a request line."""


@dataclass(frozen=True)
class DeclaredRoute:
    """What a route takes."""

    path: str
    methods: frozenset[str]
    query: Mapping[str, bool]
    """Names of the query parameters, and whether each may be repeated."""
    media_type: str | None
    """Media type of the body; None when there is no body."""
    single_parts: frozenset[str] = frozenset()
    """Names of the parts of a form that may not be repeated."""
    file_parts: frozenset[str] = frozenset()
    """Names of the parts of a form that must be files."""
    takes_if_match: bool = False
    """Whether the header If-Match is compared."""


class DeclaredRoutes:
    """The routes of an application, found by path and method before anything of the body is read."""

    def __init__(self, routes: Iterable[BaseRoute]) -> None:
        self._routes: list[tuple[re.Pattern[str], DeclaredRoute]] = [
            (route.path_regex, _declared(route)) for route in routes if isinstance(route, APIRoute)
        ]
        self._at = lru_cache(_KEPT_PATHS)(self._found)  # several parts of one request ask for the same path

    def find(self, method: str, path: str) -> DeclaredRoute | None:
        """Return the route of a request, or None; HEAD is answered as GET."""
        wanted = "GET" if method == "HEAD" else method
        return next((route for route in self._at(path) if wanted in route.methods), None)

    def methods(self, path: str) -> list[str]:
        """Return the methods of all routes at a path, sorted; HEAD wherever GET is."""
        methods = {method for route in self._at(path) for method in route.methods}
        return sorted(methods | {"HEAD"} if "GET" in methods else methods)

    def template(self, path: str) -> str | None:
        """Return the declared path that matches, such as /v1/surgeries/{surgery_id}, whatever the method."""
        return next((route.path for route in self._at(path)), None)

    def _found(self, path: str) -> tuple[DeclaredRoute, ...]:
        """Return the routes at a path: of two declared ones, that with fewer parameters is meant."""
        found = [route for pattern, route in self._routes if pattern.match(path)]
        fewest = min((route.path.count("{") for route in found), default=0)
        return tuple(route for route in found if route.path.count("{") == fewest)


def _declared(route: APIRoute) -> DeclaredRoute:
    methods, query = frozenset(route.methods or ()), dict(_query(route.dependant))
    if route.body_field is None:
        content = (route.openapi_extra or {}).get("requestBody", {}).get("content", {})
        return DeclaredRoute(
            route.path,
            methods,
            query,
            next(iter(content), None),
            takes_if_match=_takes_if_match(route.dependant),
        )
    info = route.body_field.field_info
    model: Any = info.annotation
    fields: Mapping[str, FieldInfo] = model.model_fields if isinstance(info, Form) else {}
    return DeclaredRoute(
        route.path,
        methods,
        query,
        getattr(info, "media_type", "application/json"),
        frozenset(name for name, field in fields.items() if not _is_list(field.annotation)),
        frozenset(name for name, field in fields.items() if _is_file(field.annotation)),
        _takes_if_match(route.dependant),
    )


def _query(dependant: Dependant) -> Iterator[tuple[str, bool]]:
    """Yield the query parameters of a route and of what it depends on."""
    for field in dependant.query_params:
        yield field.alias, _is_list(field.field_info.annotation)
    for inner in dependant.dependencies:
        yield from _query(inner)


def _takes_if_match(dependant: Dependant) -> bool:
    """Return whether a route or what it depends on has the header If-Match."""
    own = any(field.alias.lower() == "if-match" for field in dependant.header_params)
    return own or any(map(_takes_if_match, dependant.dependencies))


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) in {list, tuple, set} or any(map(_is_list, get_args(annotation)))


def _is_file(annotation: Any) -> bool:
    """Return whether values are files and nothing else."""
    if get_origin(annotation) is Annotated:
        return _is_file(get_args(annotation)[0])
    inner = [part for part in get_args(annotation) if part is not type(None)]
    return annotation is UploadFile or (bool(inner) and all(map(_is_file, inner)))
