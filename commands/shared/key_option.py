"""The option of commands that ask a service: the API key."""

from __future__ import annotations

from typing import Annotated

import typer

Key = Annotated[
    str | None,
    typer.Option(
        help="API key of the service; in the variable other users of this machine do not see it.",
        envvar="SPINEWATCH_KEY",
        show_default="none",
    ),
]
