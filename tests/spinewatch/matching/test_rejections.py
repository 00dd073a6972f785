from spinewatch.matching.rejections import HEURISTICS, Heuristic, TriadRejection


def test_each_heuristic_stands_for_one_reason() -> None:
    assert sorted(HEURISTICS.values()) == sorted(Heuristic)
    assert set(HEURISTICS) < set(TriadRejection)
