"""Measures over the stages, attribution, and the table of vertebrae: what is shown is what the API has."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.numbers import fixed, interval, signed
from tests.dashboard.sample import STAGES, summary
from tests.http.harness import Service

DASH = "\N{EN DASH}"
SYMBOLS = {"deg": "°", "mm": "\N{NARROW NO-BREAK SPACE}mm"}


@pytest.fixture
def stages(service: Service, measured: str) -> list[dict[str, Any]]:
    return list(summary(service, measured)["stages"])


def key(measure: dict[str, Any]) -> str:
    """The name that the page gives a measure: of a curve, or of levels of the whole spine."""
    return f"{measure['definition']} {measure['curve'] or '-'.join(measure['levels'])}"


def copied(panel: Locator, page: Page) -> list[dict[str, str]]:
    """Press the button that copies a table, and return what a spreadsheet would get."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    panel.get_by_role("button", name="Copy table").click()
    expect(panel.get_by_role("status")).to_have_text("Copied")
    return list(
        csv.DictReader(io.StringIO(page.evaluate("navigator.clipboard.readText()")), dialect=csv.excel_tab)
    )


def number(text: str) -> float | None:
    return None if text == "" else float(text)


def test_every_measure_of_every_stage_is_in_the_table(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        panel = visitor.page.get_by_role("region", name="Measures over the stages")
        panel.get_by_role("button", name="Table", exact=True).click()
        for stage in stages:
            for measure in stage["spine"]["measures"]:
                cell = panel.locator(f"tr[data-measure='{key(measure)}'] td[data-stage='{stage['name']}']")
                if measure["value"] is None:
                    expect(cell).to_contain_text(DASH)
                    expect(cell).to_contain_text(measure["reason"])
                else:
                    unit = SYMBOLS[measure["unit"]]
                    expect(cell).to_contain_text(f"{fixed(measure['value'])}{unit}")
                    expect(cell).to_contain_text(interval(measure["interval"], unit))
                status = "assumed" if measure["status"] == "measured" else measure["status"].replace("_", " ")
                expect(cell.locator(".status-mark")).to_have_text(status)


def test_every_plot_has_its_values_as_text_and_its_definition(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    definitions = service.client.get("/v1/measure-definitions").json()["items"]
    formula = next(item["formula"] for item in definitions if item["id"] == "cobb-fixed")
    with visit(service) as visitor:
        visitor.surgery(measured)
        card = visitor.page.locator("[data-measure='cobb-fixed curve 1']")
        text = card.get_by_role("img", name="Cobb angle, end vertebrae of the baseline").get_attribute(
            "aria-label"
        )
        assert text is not None
        for stage in stages:
            measure = next(m for m in stage["spine"]["measures"] if m["definition"] == "cobb-fixed")
            assert (
                f"{stage['name']}: {fixed(measure['value'])}°, 95% {interval(measure['interval'], '°')}"
                in text
            )
        expect(card).to_contain_text("positive: convex to the right")
        expect(card.get_by_text(formula)).to_be_hidden()
        card.get_by_text("Definition").click()
        expect(card.get_by_text(formula)).to_be_visible()
        none = visitor.page.locator("[data-measure='plane-of-maximum-curvature curve 1']")
        expect(none).to_contain_text("so nearly parallel")


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_plots_are_drawn_in_both_themes(
    service: Service, visit: Visit, measured: str, theme: str
) -> None:
    with visit(service, theme=theme) as visitor:
        visitor.surgery(measured)
        canvas = visitor.page.locator("[data-measure='cobb-fixed curve 1'] canvas")
        expect(canvas).to_be_visible()
        before = colours(canvas)
        assert len(before) > 5
        visitor.page.get_by_role("button", name="theme").click()
        expect(canvas).to_be_visible()
        assert colours(canvas) != before


def colours(canvas: Locator) -> set[int]:
    """The colours of the pixels of a canvas that are not transparent."""
    found: list[int] = canvas.evaluate(
        """canvas => {
            const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            const found = new Set();
            for (let i = 0; i < data.length; i += 4)
              if (data[i + 3] === 255) found.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]);
            return [...found];
        }"""
    )
    return set(found)


def test_the_measures_are_copied_at_full_precision(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    expected = {
        (stage["name"], measure["definition"], DASH.join(measure["levels"])): measure
        for stage in stages
        for measure in stage["spine"]["measures"]
    }
    with visit(service) as visitor:
        visitor.surgery(measured)
        panel = visitor.page.get_by_role("region", name="Measures over the stages")
        rows = copied(panel, visitor.page)
    found = {(row["stage"], row["measure"], row["levels"]): row for row in rows}
    assert set(expected) <= set(found)
    for name, measure in expected.items():
        row = found[name]
        low, high = measure["interval"] or (None, None)
        assert [number(row[column]) for column in ("value", "sd", "low_95", "high_95")] == [
            measure["value"],
            measure["sd"],
            low,
            high,
        ]


def test_the_attribution_of_each_manoeuvre_is_that_of_the_api_and_adds_up(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        panel = visitor.page.get_by_role("region", name="Rotation and distraction")
        choice = panel.get_by_label("Manoeuvre")
        expect(choice.locator("option")).to_have_text(["PRE → INTER", "INTER → POST", "PRE → POST"])
        for label, change in (
            ("PRE → INTER", stages[1]["spine"]["since_previous"]),
            ("INTER → POST", stages[2]["spine"]["since_previous"]),
            ("PRE → POST", stages[2]["spine"]["since_baseline"]),
        ):
            choice.select_option(label=label)
            for item in change["attribution"]:
                check_attribution(panel, item)
        rows = copied(panel, visitor.page)
    for row in rows:
        parts = [number(row[part]) for part in ("rotation", "distraction", "remainder")]
        if None not in parts:
            assert sum(part for part in parts if part is not None) == pytest.approx(number(row["total"]))


def check_attribution(panel: Locator, item: dict[str, Any]) -> None:
    row = panel.locator(f"tr[data-subject='{item['subject']} {item['quantity']}']")
    if item["total"]["value"] is None:
        expect(row).to_have_count(0)
        expect(panel.get_by_text("Without an attribution")).to_contain_text(item["subject"])
        return
    for part in ("total", "rotation", "distraction"):
        share, cell = item[part], row.locator(f"td[data-part='{part}']")
        if share["value"] is None:
            expect(cell).to_contain_text(item["reason"])
        else:
            unit = SYMBOLS[item["unit"]]
            expect(cell).to_have_text(f"{signed(share['value'])} ± {fixed(share['sd'])}{unit}")


def test_the_vertebrae_are_those_of_the_api_sorted_and_copied(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    spine = stages[2]["spine"]
    changes = spine["since_baseline"]["vertebrae"]
    with visit(service) as visitor:
        visitor.surgery(measured)
        panel = visitor.page.get_by_role("region", name="Vertebrae at POST since PRE")
        expect(panel.locator("caption")).to_contain_text(spine["frame"])
        names = panel.locator("tbody th")
        expect(names).to_have_text([change["vertebra"] for change in changes])
        for change in changes:
            check_vertebra(panel.locator(f"tr[data-vertebra='{change['vertebra']}']"), change)
        header = panel.get_by_role("columnheader", name="Derotation")
        header.get_by_role("button").press("Enter")
        expect(header).to_have_attribute("aria-sort", "ascending")
        known = [change for change in changes if change["derotation_deg"] is not None]
        known.sort(key=lambda change: change["derotation_deg"])
        unknown = [change for change in changes if change["derotation_deg"] is None]
        ordered = [change["vertebra"] for change in (*known, *unknown)]
        expect(names).to_have_text(ordered)
        rows = copied(panel, visitor.page)
        assert [row["vertebra"] for row in rows] == ordered
        for row, change in zip(rows, (*known, *unknown), strict=True):
            assert [number(row[f"{axis}_mm"]) for axis in "xyz"] == change["translation_mm"]
            assert [number(row[f"{axis}_sd_mm"]) for axis in "xyz"] == change["translation_sd_mm"]
            assert number(row["coronal_deg"]) == change["coronal_deg"]


def check_vertebra(row: Locator, change: dict[str, Any]) -> None:
    translation = zip("xyz", change["translation_mm"], change["translation_sd_mm"], strict=True)
    expected = {axis: (value, sd, "mm") for axis, value, sd in translation}
    for name in ("derotation", "coronal", "sagittal"):
        expected[name] = (change[f"{name}_deg"], change[f"{name}_sd_deg"], "deg")
    for column, (value, sd, unit) in expected.items():
        cell = row.locator(f"td[data-column='{column}']")
        if value is None:
            expect(cell).to_contain_text(change["reason"])
        else:
            expect(cell).to_have_text(f"{signed(value)} ± {fixed(sd)}{SYMBOLS[unit]}")


def test_motion_between_any_two_stages_can_be_chosen(
    service: Service, visit: Visit, measured: str, stages: list[dict[str, Any]]
) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        page = visitor.page
        page.get_by_role("region", name="Vertebrae at POST since PRE").get_by_label("Since").select_option(
            "INTER"
        )
        panel = page.get_by_role("region", name="Vertebrae at POST since INTER")
        for change in stages[2]["spine"]["since_previous"]["vertebrae"]:
            check_vertebra(panel.locator(f"tr[data-vertebra='{change['vertebra']}']"), change)


def test_a_vertebra_is_selected_by_keyboard(service: Service, visit: Visit, measured: str) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        button = visitor.page.get_by_role("region", name="Vertebrae at").get_by_role(
            "button", name="T9", exact=True
        )
        button.press("Enter")
        expect(button).to_have_attribute("aria-pressed", "true")
        button.press("Enter")
        expect(button).to_have_attribute("aria-pressed", "false")


def test_the_first_stage_gives_the_reason_instead_of_motion(
    service: Service, visit: Visit, measured: str
) -> None:
    with visit(service) as visitor:
        visitor.open(f"/surgeries/{measured}/stages/{STAGES[0]}")
        row = visitor.page.get_by_role("region", name="Vertebrae at PRE").locator("tr[data-vertebra='T9']")
        expect(row.locator("td[data-column='x']")).to_contain_text("first stage with a spine")
