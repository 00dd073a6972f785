"""The two views at the same time: array operations release the interpreter lock, so that two cores halve the time."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def both(
    function: Callable[[Item], Result], left: Item, right: Item, pool: Executor | None = None
) -> tuple[Result, Result]:
    """Return the results of a function for the left and the right view.

    Parameters
    ----------
    function
        The function.
    left, right
        Its arguments.
    pool
        Executes the right view at the same time as the left one; None for one after the other. The matrices are small:
        let matrix products use one thread per view (``OPENBLAS_NUM_THREADS=1`` before NumPy is imported).

    Returns
    -------
    tuple
        Left and right result.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(max_workers=1) as pool:
    ...     both(abs, -1, -2, pool)
    (1, 2)
    """
    if pool is None:
        return function(left), function(right)
    other = pool.submit(function, right)
    return function(left), other.result()
