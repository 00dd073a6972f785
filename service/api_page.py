"""The files of the page ``/docs``, which are sent as those of the dashboard are: compressed once."""

from __future__ import annotations

from pathlib import Path

import fastapi_offline
from fastapi import FastAPI
from starlette.routing import Mount

from service.dashboard_page import MEDIA_TYPES, PageFile, add_file

FOLDER_PATH = "/docs/assets"
"""Path of the folder of these files."""

_FOLDER = Path(fastapi_offline.__file__).parent / "static"
_MEDIA_TYPES = {**MEDIA_TYPES, ".png": "image/png"}
_NAMES = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png")


def install(app: FastAPI) -> None:
    """Send the files of the page, in the place of the folder that ``FastAPIOffline`` sends.

    Parameters
    ----------
    app
        The application.
    """
    app.router.routes[:] = [route for route in app.router.routes if not isinstance(route, Mount)]
    for name in _NAMES:
        file = _FOLDER / name
        add_file(app, f"{FOLDER_PATH}/{name}", PageFile(file.read_bytes(), _MEDIA_TYPES[file.suffix]))
