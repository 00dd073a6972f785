"""The benchmark of radiographs on few pairs, and its bars on constructed errors."""

from collections import Counter

import numpy as np
import pytest

from bench import radiographs
from bench.radiographs import Trials, promised, table, trials


def test_few_pairs_keep_the_promise(capsys: pytest.CaptureFixture[str]) -> None:
    assert radiographs.main(["--pairs", "3"]) == 0
    assert "axial rotation" in capsys.readouterr().out


def test_the_same_pairs_give_the_same_errors() -> None:
    np.testing.assert_array_equal(trials(2, 2.0).errors, trials(2, 2.0).errors)


def constructed(size: float, flags: int = 0) -> Trials:
    errors = size * np.random.default_rng(0).standard_normal((500, 17, 6))
    return Trials(
        errors,
        np.ones_like(errors),
        (errors**2).sum(axis=-1),
        errors[:, 0, 0],
        Counter({"radiograph-scale": flags}),
    )


def test_errors_as_large_as_stated_pass_and_others_do_not() -> None:
    assert all(bar.holds for bar in promised(constructed(1.0)))
    for size in (0.7, 1.4):
        assert [bar.holds for bar in promised(constructed(size))] == [False, False, False, True]
    assert not promised(constructed(1.0, flags=11))[-1].holds


def test_the_table_has_the_errors() -> None:
    rows = table(constructed(2.0), 1.0).rows
    assert rows[0][0] == "position, anterior, mm"
    assert float(rows[0][1]) == pytest.approx(2.0, rel=0.05)
    assert rows[5][2] == "1.000"
