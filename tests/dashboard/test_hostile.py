"""What others wrote is shown as text, whatever it is."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.dashboard.conftest import Visit
from tests.dashboard.test_upload import choose, payload
from tests.http.harness import RIG, SAMPLE, VERTEBRAE, Service

NAMES = (
    "<img src=x onerror=alert(1)>",
    "<script>alert(1)</script>",
    '"><svg onload=alert(1)>',
    "javascript:alert(1)//'`${alert(1)}",
    "{{constructor.constructor('alert(1)')()}}",
)


@pytest.mark.parametrize("name", NAMES)
def test_a_hostile_case_number_is_text(service: Service, visit: Visit, name: str) -> None:
    body = {"reference": name, "vertebrae": VERTEBRAE, "reference_vertebra": "L1", "spine_axis": "x"}
    answer = service.client.post("/v1/surgeries", json=body)
    assert answer.status_code == 201, answer.text
    with visit(service) as visitor:
        expect(visitor.page.get_by_role("link", name=name, exact=True).first).to_be_visible()
        visitor.open(f"/surgeries/{answer.json()['id']}")
        expect(visitor.page.get_by_role("heading", level=1)).to_have_text(name)
        expect(visitor.page).to_have_title(f"{name} · Spinewatch")


@pytest.mark.parametrize("name", NAMES[:3])
def test_hostile_names_of_a_calibration_and_of_files_are_text(
    service: Service, visit: Visit, name: str
) -> None:
    service.calibration({**RIG, "name": name})
    surgery = service.surgery()
    with visit(service) as visitor:
        page = visitor.page
        visitor.open(f"/surgeries/{surgery}")
        expect(
            page.get_by_label("Calibration").locator("option").filter(has_text=name).first
        ).to_be_attached()
        images = [(SAMPLE / "PRE" / f"{side}.png").read_bytes() for side in ("left", "right")]
        file_name = name.replace("/", "_")
        choose(
            page,
            [payload(f"{file_name} {side}.png", image) for side, image in zip("LR", images, strict=True)],
        )
        expect(page.get_by_label("Left image of pair 1", exact=True).locator("option:checked")).to_have_text(
            f"{file_name} L.png"
        )


@pytest.mark.parametrize("name", ["../../etc", "<b>", "%3Cimg%20src%3Dx%20onerror%3Dalert(1)%3E"])
def test_a_hostile_address_is_text(service: Service, visit: Visit, measured: str, name: str) -> None:
    with visit(service) as visitor:
        visitor.tolerated = ("404", "422")
        visitor.open(f"/surgeries/{measured}/stages/{name}")
        expect(visitor.page.locator("main")).to_contain_text(
            "no stage" if "/" not in name else "No such page"
        )
        visitor.open(f"/{name}")
        expect(visitor.page.get_by_role("heading", name="No such page")).to_be_visible()
