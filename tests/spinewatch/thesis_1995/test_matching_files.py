from dataclasses import replace

import numpy as np

from spinewatch.thesis_1995.matching_files import CANDIDATES, TRIPLETS, format_candidate_sets, format_triplets
from tests.spinewatch.thesis_1995.matched import matched

FOUND = matched()


def rows(text: str, columns: tuple[str, ...]) -> list[list[str]]:
    first, *lines = text.splitlines()
    assert first.endswith(" ".join(columns))
    found = [line.split() for line in lines]
    assert {len(row) for row in found} == {len(columns)}
    return found


def test_every_candidate_pair_has_a_row() -> None:
    table = rows(format_candidate_sets(FOUND), CANDIDATES)
    assert [[int(row[0]) - 1, int(row[1]) - 1] for row in table] == np.argwhere(FOUND.sets.pairs).tolist()
    assert {row[5] for row in table} == {"-"}


def test_candidates_that_the_refinement_discarded_are_told() -> None:
    none = np.zeros_like(FOUND.sets.of_left)
    refined = replace(FOUND.refined, of_left=none, of_right=none)
    found = replace(FOUND, refined=refined, correlation=np.full(none.shape, 0.25))
    table = rows(format_candidate_sets(found), CANDIDATES)
    assert {(row[4], row[5]) for row in table} == {("0", "0.2500")}


def test_triplets_are_those_of_the_tables() -> None:
    table = rows(format_triplets(FOUND), TRIPLETS)
    assert [row[-1] for row in table] == list(FOUND.selection.verdicts)
    assert [float(row[1]) for row in table] == [round(t.error_mm, 4) for t in FOUND.features]
    assert table[0][2:8] == [str(k + 1) for pair in FOUND.features[0].pairs for k in pair]
