"""The start of a process: what is loaded stays, so that no garbage is looked for."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loading() -> Iterator[None]:
    """Load modules and make long-lived objects; to look through them again and again is a fifth of a start."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
