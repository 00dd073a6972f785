import re
from copy import deepcopy
from html import unescape
from typing import Any

from reports.calibration import calibration_report

Document = dict[str, Any]
HOSTILE = """</title><script>alert("x")</script>&'"""


def text_of(page: str) -> str:
    """Return the text of a page as a browser shows it, with single spaces."""
    body = re.sub(r"<style>.*?</style>", "", page, flags=re.S)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", body)).split())


def test_no_entity_is_escaped_twice(calibration: Document) -> None:
    page = calibration_report(calibration)
    assert not re.search(r"&amp;(#|[a-z]+;)", page)
    assert not re.search(r"&#?\w+;", text_of(page))


def test_a_held_out_shot_has_no_image_residuals_but_a_reconstruction(calibration: Document) -> None:
    page = calibration_report(calibration)
    (row,) = re.findall(r'<tr class="held-out"><td>A</td>.*?</tr>', page, re.S)
    cells = re.findall(r"<td>(.*?)</td>", row)
    (shot,) = (shot for shot in calibration["shots"] if shot["name"] == "A")
    deviations = [f"{sd:.3f}" for sd in shot["sd_mm"]]
    assert cells == ["A", "no", str(shot["reconstructed"]), *deviations, "–", "–"]


def test_the_relative_orientation_is_printed_with_standard_deviations(calibration: Document) -> None:
    geometry = calibration["geometry"]
    expected = f"baseline {geometry['baseline_mm']:.2f} ± {geometry['baseline_sd_mm']:.2f} mm"
    assert expected in text_of(calibration_report(calibration))


def test_correlations_are_sorted_by_magnitude(calibration: Document) -> None:
    page = calibration_report(calibration)
    printed = [abs(float(value)) for value in re.findall(r"<td>([+-]\d\.\d{3})</td></tr>", page)]
    assert len(printed) == len(calibration["correlations_above_0.9"]) > 1
    assert printed == sorted(printed, reverse=True)


def test_each_image_point_is_plotted_and_a_removed_one_is_marked(calibration: Document) -> None:
    document = deepcopy(calibration)
    shot = document["shots"][0]
    point = shot["points"]["left"][0]["id"]
    document["removed"] = [{"side": "left", "shot": shot["name"], "id": point}]
    page = calibration_report(document)
    points = [p for s in document["shots"] for side in ("left", "right") for p in s["points"][side]]
    assert page.count("<circle") == len(points)
    assert page.count("<path") == sum(p.get("residual_px") is not None for p in points)
    (mark,) = re.findall(r'fill="#c62828"/><text [^>]*>(.*?)</text>', page)
    assert mark == point


def test_unknown_numbers_are_dashes(calibration: Document) -> None:
    document = deepcopy(calibration)
    document["geometry"].update(baseline_sd_mm=None, depth_of_field_mm=[500.0, None])
    document["cameras"]["left"]["sd"]["f"] = None
    text = text_of(calibration_report(document))
    assert "± – mm" in text
    assert "500 to – mm" in text
    assert "undetermined" in text


def test_a_report_without_a_time_or_leave_one_out_is_complete(calibration: Document) -> None:
    document = {**calibration, "calibrated_at": None, "leave_one_out": None, "correlations_above_0.9": []}
    text = text_of(calibration_report(document))
    assert "None above 0.9." in text
    assert "None ·" not in text
    assert "left out one by one" not in text


def test_names_and_flags_are_escaped(calibration: Document) -> None:
    document = deepcopy(calibration)
    document["rig"]["name"] = HOSTILE
    document["control_field"]["name"] = HOSTILE
    document["flags"] = [{"code": HOSTILE, "detail": HOSTILE}]
    for shot in document["shots"]:
        shot["name"] += HOSTILE
        shot["points"]["left"][0]["id"] = HOSTILE
    page = calibration_report(document)
    assert "<script" not in page
    assert page.count("</title>") == 1
    assert text_of(page).count(HOSTILE) > 6


def test_the_page_refers_to_nothing_else(calibration: Document) -> None:
    page = calibration_report(calibration)
    assert not re.search(r"https?:|src=|href=|url\(|@import", page)
