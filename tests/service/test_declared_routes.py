from typing import Annotated, Any

import pytest
from fastapi import APIRouter, Depends, Form, Query, UploadFile
from pydantic import BaseModel

from service.app import create_app
from service.declared_routes import DeclaredRoutes
from service.routes import calibrations, spine, surgeries
from settings import Settings


class Body(BaseModel):
    count: int


class Parts(BaseModel):
    name: str
    image: UploadFile
    either: UploadFile | str
    maybe: UploadFile | None = None
    left: list[UploadFile]
    times: list[str] = []


def inherited(deep: str = "") -> None: ...


router = APIRouter(prefix="/v1/things")


@router.get("/{thing}")
def show(
    thing: str,
    found: Annotated[None, Depends(inherited)],
    first: Annotated[int, Query(alias="from")] = 0,
    tag: Annotated[list[str] | None, Query()] = None,
) -> None: ...


@router.put("/{thing}")
def replace(thing: str, body: Body) -> None: ...


@router.post("/{thing}")
def send(thing: str, form: Annotated[Parts, Form(media_type="multipart/form-data")]) -> None: ...


@router.post("/{thing}/cancel")
def cancel(thing: str) -> None: ...


@router.post("/{thing}/table", openapi_extra={"requestBody": {"content": {"text/csv": {}}}})
def table(thing: str) -> None: ...


@router.post("/fit")
def fit(body: Body) -> None: ...


ROUTES = DeclaredRoutes(router.routes)


def test_a_route_is_found_by_method_and_path() -> None:
    found = ROUTES.find("PUT", "/v1/things/7")
    assert found is not None
    assert found.path == "/v1/things/{thing}"
    assert ROUTES.find("HEAD", "/v1/things/7") == ROUTES.find("GET", "/v1/things/7")
    for method, path in (("DELETE", "/v1/things/7"), ("GET", "/v1/things"), ("GET", "/v1/things/7/cancel")):
        assert ROUTES.find(method, path) is None


def test_methods_and_template_of_a_path() -> None:
    assert ROUTES.methods("/v1/things/7") == ["GET", "HEAD", "POST", "PUT"]
    assert ROUTES.methods("/v1/things/7/cancel") == ["POST"]
    assert ROUTES.methods("/v1/nothing") == []
    assert ROUTES.template("/v1/things/7") == "/v1/things/{thing}"
    assert ROUTES.template("/v1/nothing") is None


def test_query_parameters_include_those_of_dependencies() -> None:
    found = ROUTES.find("GET", "/v1/things/7")
    assert found is not None
    assert found.query == {"from": False, "tag": True, "deep": False}


@pytest.mark.parametrize(
    ("method", "path", "media_type"),
    [
        ("GET", "/v1/things/7", None),
        ("PUT", "/v1/things/7", "application/json"),
        ("POST", "/v1/things/7", "multipart/form-data"),
        ("POST", "/v1/things/7/cancel", None),
        ("POST", "/v1/things/7/table", "text/csv"),
    ],
)
def test_the_media_type_of_a_body(method: str, path: str, media_type: str | None) -> None:
    found = ROUTES.find(method, path)
    assert found is not None
    assert found.media_type == media_type


def test_parts_that_come_once_and_parts_that_are_files() -> None:
    found = ROUTES.find("POST", "/v1/things/7")
    assert found is not None
    assert found.single_parts == {"name", "image", "either", "maybe"}
    assert found.file_parts == {"image", "maybe", "left"}


def test_every_route_of_the_contract_is_declared() -> None:
    app = create_app(Settings())
    routes: list[Any] = [layer.kwargs["routes"] for layer in app.user_middleware if "routes" in layer.kwargs]
    assert routes
    for path, operations in app.openapi()["paths"].items():
        for method in operations:
            found = routes[0].find(method.upper(), path)
            assert found is not None, f"{method} {path}"
            assert found.path == path


def test_of_two_paths_that_with_fewer_parameters_is_meant() -> None:
    found = ROUTES.find("POST", "/v1/things/fit")
    assert found is not None
    assert found.path == "/v1/things/fit"
    assert ROUTES.methods("/v1/things/fit") == ["POST"]
    assert ROUTES.find("GET", "/v1/things/fit") is None


def test_the_paths_that_compare_if_match() -> None:
    setup = "/v1/surgeries/a/spine"
    declared = DeclaredRoutes([*spine.router.routes, *surgeries.router.routes, *calibrations.router.routes])
    for path in (setup, f"{setup}/initial"):
        route = declared.find("PUT", path)
        assert route is not None
        assert route.takes_if_match
    for method, path in (
        ("GET", setup),
        ("DELETE", "/v1/surgeries/a"),
        ("POST", "/v1/calibrations/from-images"),
    ):
        route = declared.find(method, path)
        assert route is not None
        assert not route.takes_if_match
