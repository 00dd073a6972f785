import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from spinewatch.parallel import both
from tests.patience import PATIENCE_S


def test_results_are_in_the_order_of_the_views_with_and_without_a_pool() -> None:
    assert both(abs, -1, -2) == (1, 2)
    with ThreadPoolExecutor(1) as pool:
        assert both(abs, -1, -2, pool) == (1, 2)


def test_a_pool_computes_the_views_at_the_same_time() -> None:
    together = threading.Barrier(2, timeout=PATIENCE_S)

    def meet(view: str) -> str:
        together.wait()
        return view

    with ThreadPoolExecutor(1) as pool:
        assert both(meet, "left", "right", pool) == ("left", "right")


@pytest.mark.parametrize("wrong", [0, 1])
def test_errors_of_either_view_are_raised(wrong: int) -> None:
    def fail(number: int) -> int:
        if number == wrong:
            raise ValueError("wrong view")
        return number

    with ThreadPoolExecutor(1) as pool, pytest.raises(ValueError, match="wrong view"):
        both(fail, 0, 1, pool)
