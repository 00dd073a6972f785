from fastapi import FastAPI

from service.middleware.head import Head
from tests.service.middleware.asgi import request


def app() -> FastAPI:
    app = FastAPI()

    @app.get("/")
    def show() -> dict[str, int]:
        return {"answer": 42}

    @app.post("/only-post")
    def change() -> None: ...

    app.add_middleware(Head)
    return app


def test_head_has_the_status_and_headers_of_get() -> None:
    got, head = (request(app(), method) for method in ("GET", "HEAD"))
    assert got.json() == {"answer": 42}
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers == got.headers


def test_head_is_refused_where_get_is() -> None:
    head = request(app(), "HEAD", "/only-post")
    assert (head.status_code, head.content) == (405, b"")
