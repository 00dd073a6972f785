import re
from html.parser import HTMLParser

import pytest

from contract.flag import Flag
from contract.spine import StageSpine
from contract.summary import SurgerySummary
from reports.surgery import render_surgery
from spinewatch.flags import FLAGS
from spinewatch.spine.configuration import InitialKind, Origin
from spinewatch.spine.definitions import DEFINITIONS
from tests.contract.spine_results import stage_spine, summary

HOSTILE = '<script>alert("1")</script><img src=x onerror=alert(1)>&copy;\u202e{{ 7 * 7 }}'


class Page(HTMLParser):
    """Tags, attributes, references and visible text of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.references: list[str] = []
        self.handlers: list[str] = []
        self.text = ""
        self._hidden = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._hidden = tag == "style"
        self.references += [
            f"{name}={value}" for name, value in attrs if name in {"href", "src", "action", "data"}
        ]
        self.handlers += [name for name, _ in attrs if name.startswith("on")]

    def handle_endtag(self, tag: str) -> None:
        self._hidden = False

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text += f" {data}"


def text_of(found: SurgerySummary) -> str:
    return " ".join(Page(render_surgery(found)).text.split())


def with_spine(spine: StageSpine) -> SurgerySummary:
    whole = summary()
    return whole.model_copy(update={"stages": [whole.stages[0].model_copy(update={"spine": spine})]})


def test_the_page_refers_to_nothing_outside() -> None:
    html = render_surgery(summary())
    page = Page(html)
    assert page.references == []
    assert not {"script", "link", "img", "iframe", "object", "image", "use"} & set(page.tags)
    assert not re.search(r"url\(|@import|https?://", html)
    assert "default-src 'none'" in html
    assert '<html lang="en">' in html


def test_the_result_has_both_ends_and_the_change_with_their_intervals() -> None:
    text = text_of(summary())
    assert "58.3° 56.1 to 60.5° 11.7° 9.5 to 13.8° −23.3° −25.5 to −21.1°" in text
    assert "curve 1: T7–L1, apex T9, convex to the right" in text
    assert "L1 is the end of the measured span" in text
    assert "Spinewatch is not a medical device, and no decision about a patient may rest on it." in text


def test_the_head_says_what_was_measured_in_which_frame_by_which_version() -> None:
    found = summary()
    text = text_of(found)
    spine = stage_spine(2)
    for part in (
        found.reference,
        found.surgery_id,
        "PRE → INTER → POST → EXTRA",
        spine.frame,
        spine.reference_line,
    ):
        assert part in text
    assert "Spinewatch 0.2.0" in text
    assert "setup revision 1" in text
    assert "2026-11-21 09:30:00 UTC" in text


def test_what_was_not_measured_is_a_dash_with_its_reason() -> None:
    text = text_of(summary())
    assert "– not measured L5 was not measured" in text
    assert "Not measured at PRE and not drawn: T5, T6, L2." in text
    assert "T5, T6, L2: it lies outside the marked vertebrae T7 to L1" in text
    assert "EXTRA has no spine: the stage was not measured." in text
    assert "None" not in text
    assert "nan" not in text.lower().split()


def test_flags_come_with_what_to_do_and_an_unknown_one_is_kept() -> None:
    text = text_of(summary())
    assert f"POST rig-refined an example of a flag {FLAGS['rig-refined'].action}" in text
    assert "1 flag raised" in text
    later = [Flag(code="from-a-later-version", detail="something is odd")]
    text = text_of(with_spine(stage_spine(0).model_copy(update={"flags": later})))
    assert "PRE from-a-later-version something is odd unknown to this version" in text


def test_every_definition_that_is_used_is_explained_and_an_unknown_one_is_named() -> None:
    text = text_of(summary())
    for identifier in ("cobb-fixed", "kyphosis", "apical-translation"):
        assert DEFINITIONS[identifier].reference in text
    spine = stage_spine(0)
    measures = [measure.model_copy(update={"definition": "later"}) for measure in spine.measures[:1]]
    assert "later not known to this version" in text_of(
        with_spine(spine.model_copy(update={"measures": measures}))
    )


def test_images_are_named_by_their_hash() -> None:
    assert text_of(summary()).count("ab" * 32) == 8


def test_changes_attribution_motion_and_what_remains_are_there() -> None:
    text = text_of(summary())
    for part in (
        "POST since PRE",
        "POST since INTER",
        "INTER since PRE",
        "What the correction came with",
        "At POST",
    ):
        assert part in text
    # Measures of the curve and of the whole spine, attribution, motion; never twice for the second stage.
    assert text.count("INTER since PRE") == 4


def test_origins_differ_in_shape_and_dash_and_not_only_in_colour() -> None:
    spine = stage_spine(0)
    states = [
        state.model_copy(update={"origin": Origin.ASSUMED}) if state.vertebra == "T12" else state
        for state in spine.vertebrae
    ]
    figure = render_surgery(with_spine(spine.model_copy(update={"vertebrae": states}))).split("<figure")[1]
    assert figure.count('stroke-dasharray="5 3"') == 2
    assert figure.count('stroke-dasharray="1.5 2.5"') == 1
    assert figure.count("<circle") == 6
    assert figure.count("l3.2 5.6h-6.4z") == 1


def test_two_stages_are_overlaid_in_three_views_and_one_is_drawn_alone() -> None:
    html = render_surgery(summary())
    assert html.count("<figure") == 3
    assert "PRE against POST" in html
    coronal = html.split("<figure")[1].split("</figure")[0]
    assert "#d55e00" in coronal
    assert "#0072b2" in coronal
    alone = render_surgery(with_spine(stage_spine(0)))
    assert "The spine at PRE" in alone
    assert "#d55e00" not in alone.split("<figure")[1]


def test_a_hostile_text_is_shown_as_text() -> None:
    whole = summary()
    spine = stage_spine(2)
    measures = [
        measure.model_copy(update={"reason": HOSTILE, "curve": HOSTILE}) for measure in spine.measures
    ]
    curves = [curve.model_copy(update={"name": HOSTILE, "side": HOSTILE}) for curve in spine.curves]
    states = [state.model_copy(update={"reason": HOSTILE}) for state in spine.vertebrae]
    hostile = spine.model_copy(
        update={
            "measures": measures, "curves": curves, "vertebrae": states, "frame": HOSTILE, "reference_line": HOSTILE,
            "flags": [Flag(code=HOSTILE, detail=HOSTILE)], "parameters": {HOSTILE: {HOSTILE: HOSTILE}},
        }
    )  # fmt: skip
    stages = [whole.stages[0], whole.stages[2].model_copy(update={"spine": hostile}), whole.stages[3]]
    html = render_surgery(whole.model_copy(update={"reference": HOSTILE, "stages": stages}))
    page = Page(html)
    assert "script" not in page.tags
    assert "img" not in page.tags
    assert page.handlers == []
    assert page.text.count('<script>alert("1")</script>') > 10
    assert "49" not in page.text.split("Case")[1].split("Stages")[0]


def test_the_same_summary_gives_the_same_page() -> None:
    assert render_surgery(summary()) == render_surgery(summary())


@pytest.mark.parametrize("count", [0, 1])
def test_a_surgery_without_a_spine_is_still_a_report(count: int) -> None:
    found = summary()
    bare = found.model_copy(update={"stages": found.stages[3:][:count], "setup": None})
    text = text_of(bare)
    assert "There is no curve to report." in text
    assert "No measures." in text


def test_a_generic_spine_says_that_it_is_assumed() -> None:
    text = text_of(with_spine(stage_spine(0).model_copy(update={"initial": InitialKind.GENERIC})))
    assert "a generic spine, so everything that depends on it is assumed" in text


def test_a_result_of_an_earlier_setup_says_so() -> None:
    text = text_of(with_spine(stage_spine(0).model_copy(update={"setup_revision": 3})))
    assert "The results above were computed with revision 3." in text


def test_parameters_are_listed_by_dotted_name_and_long_ones_are_cut() -> None:
    parameters = {"measures": {"draws": 2000, "levels": "x" * 500}}
    text = text_of(with_spine(stage_spine(0).model_copy(update={"parameters": parameters})))
    assert "measures.draws 2000" in text
    assert f"measures.levels {'x' * 59}…" in text


def test_sixty_stages_are_all_there() -> None:
    found = summary()
    stages = []
    for number in range(60):
        spine = stage_spine(2 if number else 0).model_copy(update={"stage": f"S{number}"})
        stages.append(found.stages[0].model_copy(update={"name": f"S{number}", "spine": spine}))
    text = text_of(found.model_copy(update={"stages": stages}))
    assert all(f"S{number} since INTER" in text for number in range(1, 60))
    assert " → ".join(f"S{number}" for number in range(60)) in text
