"""Summaries that are hostile or large, for the tests of every export."""

from __future__ import annotations

from contract.flag import Flag
from contract.summary import SummaryStage, SurgerySummary
from tests.contract.spine_results import summary

TEXTS = (
    '=HYPERLINK("http://evil","x")',
    "+1+1",
    "-2+3",
    "@SUM(A1)",
    "\tcmd",
    "\rcmd",
    "  =1",
    "'quoted",
    "<script>alert(1)</script>&amp;\"'",
    "line\r\nbreak\x00nul\x1bescape\u202eright\u2028to\x85left",
    "Größe ☃ 𝔘",
    "",
)


def with_text(text: str) -> SurgerySummary:
    """Return the example surgery with a text in every field that takes any text."""
    whole = summary()
    stages = []
    for stage in whole.stages:
        spine = stage.spine
        if spine is not None:
            vertebrae = [state.model_copy(update={"reason": text}) for state in spine.vertebrae]
            curves = [curve.model_copy(update={"name": text}) for curve in spine.curves]
            measures = [
                value.model_copy(update={"curve": text, "reason": text, "definition": text})
                for value in spine.measures
            ]
            flags = [Flag(code=text, detail=text)]
            spine = spine.model_copy(
                update={
                    "frame": text, "vertebrae": vertebrae, "curves": curves, "measures": measures, "flags": flags,
                    "reference_line": text, "version": text,
                }
            )  # fmt: skip
        stages.append(stage.model_copy(update={"spine": spine, "spine_reason": text, "version": text}))
    return whole.model_copy(update={"reference": text, "stages": stages, "version": text})


def many_stages(count: int = 60) -> SurgerySummary:
    """Return a surgery with many stages of 17 vertebrae."""
    whole = summary()
    levels = [f"T{number}" for number in range(1, 13)] + [f"L{number}" for number in range(1, 6)]
    template = whole.stages[1].spine
    assert template is not None
    measured = next(state for state in template.vertebrae if state.position_mm is not None)
    vertebrae = [measured.model_copy(update={"vertebra": level}) for level in levels]
    stages = []
    for number in range(count):
        name = f"S{number}"
        spine = template.model_copy(update={"stage": name, "vertebrae": vertebrae})
        stages.append(whole.stages[1].model_copy(update={"name": name, "spine": spine}))
    return whole.model_copy(update={"stages": stages})


def without_spines() -> SurgerySummary:
    """Return a surgery of which no stage has a spine yet."""
    whole = summary()
    stages = [stage.model_copy(update={"spine": None, "spine_reason": "no setup"}) for stage in whole.stages]
    return whole.model_copy(update={"stages": stages, "setup": None})


def stage_without_spine(summary: SurgerySummary) -> SummaryStage:
    """Return the third stage with its triads, without the reference among them."""
    flag = Flag(code="triad-count-low", detail="3 of 4 triads")
    reason = "the reference triad L1 has no pose in stage POST"
    return summary.stages[2].model_copy(update={"spine": None, "spine_reason": reason, "flags": [flag]})
