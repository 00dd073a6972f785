import pytest

from commands.shared.spine_tables import MAIN, print_measures
from tests.contract.spine_results import stage_spine


def test_values_come_with_intervals_status_and_change(capsys: pytest.CaptureFixture[str]) -> None:
    print_measures([stage_spine(0), stage_spine(2)], MAIN)
    lines = capsys.readouterr().out.splitlines()
    pre, post = (next(line for line in lines if line.startswith(name)) for name in ("PRE", "POST"))
    assert "cobb-fixed, curve 1" in pre
    assert "58.3° [56.1, 60.5]  measured" in pre
    assert "T7-L1" in post
    assert "-23.3° [-25.5, -21.1]  measured" in post
    assert not any("kyphosis" in line for line in lines)
    assert any(stage_spine(0).frame in line for line in lines)
    assert not any("assumed" in line for line in lines)


def test_all_measures_and_what_was_not_measured(capsys: pytest.CaptureFixture[str]) -> None:
    print_measures([stage_spine(1)])
    out = capsys.readouterr().out
    assert "not measured" in out
    assert "bracketed" in out
    assert " mm [" in out


def test_what_is_assumed_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    spine = stage_spine(0)
    measures = [measure.model_copy(update={"assumed": True}) for measure in spine.measures]
    print_measures([spine.model_copy(update={"measures": measures})], MAIN)
    out = capsys.readouterr().out
    assert "measured*" in out
    assert "* assumed" in out


def test_without_a_spine_nothing_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    print_measures([])
    assert capsys.readouterr().out == ""
