from typing import Annotated, Any

import pytest
from fastapi import APIRouter, Depends, FastAPI, Form, UploadFile
from pydantic import BaseModel

from service import problems
from service.declared_routes import DeclaredRoutes
from service.forms.parts import check_parts
from service.middleware.declared_request import DeclaredRequest
from tests.service.middleware.asgi import request


class Parts(BaseModel):
    name: str
    either: UploadFile | str = ""
    left: list[UploadFile] = []


router = APIRouter()


@router.post("/", dependencies=[Depends(check_parts)])
def send(form: Annotated[Parts, Form(media_type="multipart/form-data")]) -> int:
    return len(form.left)


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()
    app.include_router(router)
    problems.install(app)
    app.add_middleware(DeclaredRequest, routes=DeclaredRoutes(router.routes))
    return app


def post(app: FastAPI, *parts: tuple[str, bytes]) -> Any:
    """Return the answer to parts, each with the rest of its disposition and its content."""
    body = b"".join(
        f"--x\r\nContent-Disposition: form-data; {rest}\r\n\r\n".encode() + content + b"\r\n"
        for rest, content in parts
    )
    kind = {"Content-Type": "multipart/form-data; boundary=x"}
    return request(app, "POST", content=body + b"--x--\r\n", headers=kind).json()


NAME = ('name="name"', b"PRE")


def test_parts_that_can_be_used(app: FastAPI) -> None:
    files = [('name="left"; filename="1"', b"A\0"), ('name="left"; filename="2"', b"B")]
    assert post(app, NAME, *files, ('name="either"', b"a,b\r\n\t1,2\n")) == 2
    assert post(app, NAME, ('name="left"; filename=""', b"A")) == 1


@pytest.mark.parametrize(
    ("parts", "name", "words"),
    [
        ([NAME, NAME], "name", "twice"),
        ([NAME, ('name="left"', b"A")], "left", "filename"),
        ([NAME, ("name=\"left\"; filename*=UTF-8''a.png", b"A")], "left", "filename"),
        ([('name="name"', b"a\0")], "name", "control"),
        ([('name="name"', b"a\x1b[2J")], "name", "control"),
    ],
)
def test_parts_that_cannot(app: FastAPI, parts: list[tuple[str, bytes]], name: str, words: str) -> None:
    problem = post(app, *parts)
    assert problem["type"] == "urn:spinewatch:problem:invalid-part"
    (error,) = problem["errors"]
    assert error["loc"] == ["body", name]
    assert words in error["msg"]
