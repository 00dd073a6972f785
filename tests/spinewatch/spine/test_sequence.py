from __future__ import annotations

import pytest

from spinewatch.levels import anatomical_sequence
from spinewatch.spine.sequence import sequence_with


@pytest.mark.parametrize(
    ("names", "extra"),
    [
        ([], []),
        (["T1", "L5"], []),
        (["T13"], ["T13"]),
        (["L6", "T13"], ["T13", "L6"]),
        (["S4"], ["S2", "S3", "S4"]),
    ],
)
def test_extra_levels_are_those_that_the_names_need(names: list[str], extra: list[str]) -> None:
    assert sequence_with(names) == anatomical_sequence(extra)
