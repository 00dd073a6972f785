import json

import pytest

from spinewatch.thesis_1995.heuristics import (
    TripletFeatures,
    h1_distinct,
    h2_shared_point,
    h3_shared_feature,
    h5_complete,
    published_selection,
)
from tests.paths import DATA

TABLES = json.loads((DATA / "thesis_tables.json").read_text())
STAGES = [name for name in TABLES if name.startswith(("table_5_4", "table_5_5", "table_5_6"))]


def triplets(stage: str) -> list[TripletFeatures]:
    return [
        TripletFeatures(row["error_mm"], (tuple(row["XX"]), tuple(row["YY"]), tuple(row["MX"])))
        for row in TABLES[stage]
    ]


@pytest.mark.parametrize("stage", STAGES)
def test_the_printed_survivors_and_verdicts_are_reproduced(stage: str) -> None:
    selection = published_selection(triplets(stage), expected=4)
    for row, verdict in zip(TABLES[stage], selection.verdicts, strict=True):
        if (stage, row["triad"]) == ("table_5_5_small_stage2", 19):
            # Printed H2, though it shares no feature pair with a survivor: only H3 can discard it.
            assert verdict == "H3"
        else:
            assert verdict == row["heuristic"]
    assert selection.complete
    assert not published_selection(triplets(stage), expected=5).complete


def test_examining_strictly_in_order_would_lose_true_triads() -> None:
    rows = triplets("table_5_6_large_stage1")
    assert published_selection(rows, expected=4).verdicts[0] == "P"
    assert rows[1].error_mm < rows[0].error_mm
    assert h2_shared_point(rows[0], rows[1])  # only because H1 has struck row 1 out before


def test_each_heuristic_by_itself() -> None:
    a = TripletFeatures(1.0, ((1, 1), (2, 2), (3, 3)))
    shares_point = TripletFeatures(2.0, ((3, 3), (4, 4), (5, 5)))
    shares_feature = TripletFeatures(0.5, ((6, 1), (7, 7), (8, 8)))
    assert h1_distinct(a)
    assert not h1_distinct(TripletFeatures(1.0, ((1, 1), (1, 2), (3, 3))))
    assert not h1_distinct(TripletFeatures(1.0, ((1, 1), (2, 3), (3, 3))))
    assert h2_shared_point(a, shares_point)
    assert not h2_shared_point(a, shares_feature)
    assert h3_shared_feature(a, shares_feature)
    assert not h3_shared_feature(shares_point, shares_feature)
    assert h5_complete(4, 4)
    assert not h5_complete(3, 4)
    verdicts = published_selection([a, shares_point, shares_feature], expected=1).verdicts
    assert verdicts == ("H3", "H2", "P")
