"""The table of slips is well formed, and verdicts tell right answers from others."""

from __future__ import annotations

import re
from collections import Counter

import pytest

from bench.mistakes import MIN_PAIRS, MIN_SLIPS, Result, all_slips, main
from bench.slips.controls import controls
from bench.slips.page import page
from bench.slips.simulated import Rate, sound_rate
from bench.slips.slip import Answer, Outcome, Right, Slip

SLIPS = all_slips()
RIGHT = Right(refusal=r"line \d+", flags=("levels-implausible",), detail=r"\d+ mm", labels_null=True)


def result(code: str, detail: str, label: str | None = None) -> Answer:
    return Answer(0, "", {"flags": [{"code": code, "detail": detail}], "triads": [{"label": label}]})


def test_slips_are_many_and_have_names_of_their_own() -> None:
    assert len(SLIPS) >= MIN_SLIPS
    assert len({slip.pair for slip in SLIPS} - {"-"}) >= MIN_PAIRS
    names = Counter(slip.name for slip in (*SLIPS, *controls()))
    assert [name for name, count in names.items() if count > 1] == []


def test_every_slip_has_one_way_to_be_run_and_a_right_answer() -> None:
    for slip in SLIPS:
        assert (slip.make is None) != (slip.ask is None), slip.name
        right = slip.right
        assert right.refusal or right.flags or right.warning or right.sound, slip.name
        for pattern in (right.refusal, right.detail, right.warning):
            re.compile(pattern)


@pytest.mark.parametrize(
    ("answer", "verdict"),
    [
        (Answer(2, "spinewatch: left.csv, line 3: z_mm"), "refused"),
        (Answer(2, "spinewatch: something else"), "wrong"),
        (Answer(None, "Traceback"), "crash"),
        (Answer(1, ""), "crash"),
        (result("levels-implausible", "51 mm a level"), "flagged"),
        (result("levels-implausible", "51 mm a level", "L1"), "wrong"),
        (result("levels-implausible", "no figure"), "wrong"),
        (result("triad-count-low", "3 of 4"), "wrong"),
        (result("parameters-held", "x0"), "silent"),
        (Answer(0, "", {"triads": []}), "silent"),
    ],
)
def test_verdicts(answer: Answer, verdict: str) -> None:
    assert RIGHT.verdict(answer) == verdict


def test_a_result_that_is_right_needs_no_flag() -> None:
    right = Right(sound=lambda answer: "baseline 380" in answer.message)
    assert right.verdict(Answer(0, "baseline 380.1 mm")) == "read"
    assert right.verdict(Answer(0, "baseline 12.1 mm")) == "silent"


def test_bars_are_missed_by_a_silent_slip() -> None:
    slip = Slip("a slip", "labels", "PRE", "process", RIGHT)
    outcome = Outcome(slip, Answer(0, "", {"triads": []}))
    missed = [bar.promise for bar in Result([outcome], [], (), whole=False).bars if not bar.holds]
    assert missed == ["0 silent"]


def test_the_page_lists_answers_and_what_is_not_seen() -> None:
    slip = Slip("a slip", "labels", "PRE", "process", RIGHT)
    outcomes = [Outcome(slip, result("levels-implausible", "51 mm a level")), Outcome(slip, Answer(0))]
    text = page(outcomes, [Rate("sound stages", 1, 500, ())], [("half a pixel", "no residual")])
    assert "| a slip | process | `levels-implausible` |" in text
    assert "| a slip | process | **silent**: no flag |" in text
    assert "| sound stages | 500 | 0.2% |" in text
    assert "| half a pixel | no residual |" in text


def test_sound_simulated_stages_raise_no_flag() -> None:
    assert sound_rate(24).raised == 0


def test_a_run_of_one_slip_prints_its_verdict(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--only", "images of half the size"]) == 0
    out = capsys.readouterr().out
    assert "refused" in out
    assert "0 silent" in out
