import pytest

from bench.tables import Bar
from bench.thesis.__main__ import PARTS, main
from bench.thesis.printed import SAMPLES, printed


def test_the_printed_tables_are_there() -> None:
    assert len(printed("table_3_2")) == 30
    assert len(printed("table_5_5_small_stage2")) == 26


@pytest.mark.parametrize("part", ["motion", "matching"])
def test_a_part_prints_its_tables_and_reproduces_them(part: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(SAMPLES), "--part", part, "--check"]) == 0
    output = capsys.readouterr().out
    assert "MISSED" not in output
    assert {"motion": "Table 6.1", "matching": "Table 5.5"}[part] in output


def test_a_missed_table_ends_with_status_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        "bench.thesis.__main__.PARTS", {**PARTS, "motion": lambda _: ([], [Bar("x", "y", False)])}
    )
    assert main(["--part", "motion", "--check"]) == 1
    assert "MISSED" in capsys.readouterr().out
    assert main(["--part", "motion"]) == 0
