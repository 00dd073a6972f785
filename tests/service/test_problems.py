import sqlite3
from errno import ENOSPC
from typing import Any

import pytest
from fastapi import FastAPI, HTTPException
from pydantic import BaseModel
from sqlalchemy.exc import OperationalError

from contract.setup_checks import SpineSetupError
from service import problems
from service.problems import InvalidInputError, problem
from spinewatch.errors import ImageError, MissingPackageError, RigError, SpinewatchError
from tests.service.middleware.asgi import request


class Body(BaseModel, extra="forbid"):
    count: int


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.get("/thing")
    def show() -> None: ...

    @app.post("/thing")
    def change(body: Body) -> None: ...

    problems.install(app)
    return app


def raised(error: Exception) -> dict[str, Any]:
    app = FastAPI()

    @app.get("/")
    def fail() -> None:
        raise error

    problems.install(app)
    response = request(app, "GET")
    document: dict[str, Any] = response.json()
    assert response.headers["content-type"] == "application/problem+json"
    assert response.status_code == document["status"]
    return document


def test_a_problem_is_named_by_its_code_or_status() -> None:
    assert problem(404, "gone").type == "urn:spinewatch:problem:not-found"
    assert problem(418, "tea").type == "urn:spinewatch:problem:http-418"
    own = problem(409, "exists", "stage-exists")
    assert (own.type, own.title) == ("urn:spinewatch:problem:stage-exists", "Stage exists")


def test_a_named_error_has_its_code_and_sentence() -> None:
    class LensError(SpinewatchError):
        code = "lens-missing"

    document = raised(LensError("the lens is missing; attach it"))
    assert document["type"] == "urn:spinewatch:problem:lens-missing"
    assert (document["status"], document["detail"]) == (422, "the lens is missing; attach it")
    assert "errors" not in document


def test_a_package_that_the_service_lacks_is_no_fault_of_the_request() -> None:
    document = raised(MissingPackageError("DICOM SR", "highdicom", "pip install spinewatch[dicom]"))
    assert (document["status"], document["type"]) == (501, "urn:spinewatch:problem:missing-package")
    assert "pip install" in document["detail"]


def test_an_error_of_a_setup_names_the_path_of_the_field() -> None:
    error = SpineSetupError(("initial", "poses", 2, "rotation"), "is a reflection", "axes-reflected")
    document = raised(error)
    assert (document["status"], document["type"]) == (422, "urn:spinewatch:problem:axes-reflected")
    assert document["errors"][0]["loc"] == ["body", "initial", "poses", 2, "rotation"]


def test_an_error_of_a_rig_or_a_form_names_the_field() -> None:
    rig = raised(RigError("left.radial", "is missing"))
    assert rig["errors"][0]["loc"] == ["body", "left", "radial"]
    form = raised(InvalidInputError("right", ImageError("not an image"), 1))
    assert form["errors"] == [
        {"loc": ["body", "right", 1], "msg": "right 2: not an image", "type": "invalid-image"}
    ]


def test_a_database_that_cannot_be_reached_is_temporary() -> None:
    error = OperationalError("SELECT secret", {}, Exception("disk I/O error"))
    document = raised(error)
    assert (document["status"], document["type"]) == (503, "urn:spinewatch:problem:database-unavailable")
    assert "secret" not in document["detail"]


def test_a_full_disk_is_said_with_what_to_do() -> None:
    full = sqlite3.OperationalError("database or disk is full")
    full.sqlite_errorcode = sqlite3.SQLITE_FULL
    document = raised(OperationalError("INSERT secret", {}, full))
    assert (document["status"], document["type"]) == (503, "urn:spinewatch:problem:database-unavailable")
    assert "the disk of the database is full" in document["detail"]
    assert "make room" in document["detail"]


def test_an_invalid_body_names_the_fields_and_does_not_repeat_them(app: FastAPI) -> None:
    response = request(app, "POST", "/thing", json={"count": "marker", "<b>\n": 1})
    document = response.json()
    assert document["type"] == "urn:spinewatch:problem:invalid-request"
    assert [error["loc"] for error in document["errors"]] == [["body", "count"], ["body", "(unprintable)"]]
    assert "marker" not in response.text


def test_the_methods_of_all_routes_at_a_path_are_allowed(app: FastAPI) -> None:
    response = request(app, "DELETE", "/thing")
    assert (response.status_code, response.headers["allow"]) == (405, "GET, HEAD, POST")
    assert request(app, "GET", "/nothing").json()["detail"] == "there is no such path; see /docs"


def test_an_answer_has_at_most_twenty_errors(app: FastAPI) -> None:
    document = request(app, "POST", "/thing", json={f"k{n}": n for n in range(100)}).json()
    assert len(document["errors"]) == 20
    assert "the first 20 of 101 errors" in document["detail"]


def test_an_upload_that_cannot_be_stored_is_not_the_clients_fault() -> None:
    def failed() -> HTTPException:
        try:
            raise OSError(ENOSPC, "No space left on device")
        except OSError as cause:
            error = HTTPException(400, "There was an error parsing the body")
            error.__cause__ = cause
            return error

    document = raised(failed())
    assert (document["status"], document["type"]) == (507, "urn:spinewatch:problem:insufficient-storage")
    assert raised(HTTPException(400, "no boundary"))["status"] == 400
