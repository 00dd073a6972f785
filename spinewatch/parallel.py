"""The two views side by side: array work lets go of the interpreter, so that two cores halve the wait."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Result = TypeVar("Result")


def both(function: Callable[[Item], Result], left: Item, right: Item) -> tuple[Result, Result]:
    """Return the function's results for left and right, computed at the same time; the first error is raised.

    Meanwhile matrix products keep to one thread: more would wait for each other, actively, and for every other process.
    """
    with _products().limit(limits=1, user_api="blas"), ThreadPoolExecutor(max_workers=1) as pool:
        other = pool.submit(function, right)
        return function(left), other.result()


@cache
def _products() -> ThreadpoolController:
    return ThreadpoolController()
