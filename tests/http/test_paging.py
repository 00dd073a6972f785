"""Lists: newest first, in pages that go on where the last one ended, filtered and sorted."""

import base64
import json
from typing import Any

import pytest

from tests.http.harness import RIG, Service, code_of, pair


def walk(service: Service, path: str, **parameters: Any) -> list[list[dict[str, Any]]]:
    """Return the items of all pages."""
    pages, cursor = [], None
    while True:
        more: dict[str, str] = {} if cursor is None else {"cursor": cursor}
        answer = service.client.get(path, params={**parameters, **more})
        assert answer.status_code == 200, answer.text
        pages.append(answer.json()["items"])
        cursor = answer.json()["next_cursor"]
        if cursor is None:
            return pages


def case(service: Service, reference: str) -> str:
    body = {"reference": reference, "vertebrae": ["L1"], "reference_vertebra": "L1"}
    return str(service.client.post("/v1/surgeries", json=body).json()["id"])


def test_the_newest_comes_first_and_every_surgery_once(idle: Service) -> None:
    ids = [case(idle, "PAG-1") for _ in range(5)]
    pages = walk(idle, "/v1/surgeries", reference="PAG-1", limit=2)
    assert [len(page) for page in pages] == [2, 2, 1]
    assert [item["id"] for page in pages for item in page] == ids[::-1]
    oldest = walk(idle, "/v1/surgeries", reference="PAG-1", sort="created_at", limit=3)
    assert [item["id"] for page in oldest for item in page] == ids


def test_a_page_goes_on_after_the_last_one_whatever_is_added(idle: Service) -> None:
    ids = [case(idle, "ADD-1") for _ in range(4)]
    parameters = {"reference": "ADD-1", "limit": "2"}
    first = idle.client.get("/v1/surgeries", params=parameters).json()
    case(idle, "ADD-1")
    second = idle.client.get("/v1/surgeries", params={**parameters, "cursor": first["next_cursor"]}).json()
    assert [item["id"] for item in (*first["items"], *second["items"])] == ids[::-1]


def test_only_what_was_asked_for_is_listed(idle: Service) -> None:
    mine, other = case(idle, "M-1"), case(idle, "O-1")
    listed = idle.client.get("/v1/surgeries", params={"reference": "M-1"}).json()
    assert [item["id"] for item in listed["items"]] == [mine]
    assert listed["total"] == 1
    made = idle.client.get(f"/v1/surgeries/{other}").json()["created_at"]
    before = walk(idle, "/v1/surgeries", created_before=made)
    after = walk(idle, "/v1/surgeries", created_after=made)
    assert mine in {item["id"] for page in before for item in page}
    assert other in {item["id"] for page in after for item in page}
    assert not {item["id"] for page in before for item in page} & {
        item["id"] for page in after for item in page
    }


def test_surgeries_and_stages_are_found_by_state_and_calibration(idle: Service) -> None:
    calibration, surgery = idle.calibration(), idle.surgery()
    first = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    idle.submit(surgery, "POST", pair("POST"), idle.calibration())
    idle.client.post(f"/v1/jobs/{first}/cancel")
    path = f"/v1/surgeries/{surgery}/stages"

    def names(**parameters: str) -> list[str]:
        return [item["name"] for page in walk(idle, path, **parameters) for item in page]

    assert names() == ["POST", "PRE"]
    assert names(sort="name") == ["POST", "PRE"]
    assert names(sort="-name") == ["PRE", "POST"]
    assert names(state="cancelled") == names(calibration_id=calibration) == names(name="PRE") == ["PRE"]
    assert names(state="queued", calibration_id=calibration) == []
    found = walk(idle, "/v1/surgeries", calibration_id=calibration, state="cancelled")
    assert [item["id"] for page in found for item in page] == [surgery]


def test_calibrations_are_found_by_name(idle: Service) -> None:
    made = idle.calibration({**RIG, "name": "cart of a test"})
    idle.calibration()
    listed = idle.client.get("/v1/calibrations", params={"name": "cart of a test"}).json()
    assert [item["id"] for item in listed["items"]] == [made]


def test_jobs_are_listed(idle: Service) -> None:
    surgery = idle.surgery()
    job = idle.submit(surgery, "PRE", pair("PRE"), idle.calibration())
    listed = idle.client.get("/v1/jobs", params={"surgery_id": surgery, "state": "queued"}).json()
    assert [(item["id"], item["stage"], item["take"]) for item in listed["items"]] == [(job, "PRE", 1)]
    assert idle.client.get("/v1/jobs", params={"surgery_id": surgery, "kind": "spine"}).json()["items"] == []


@pytest.mark.parametrize("cursor", ["x", "e30", "W10", "WyJhIiwiYiIsImMiXQ", "%00", "A" * 600])
def test_a_cursor_that_is_none_is_refused(idle: Service, cursor: str) -> None:
    answer = idle.client.get("/v1/surgeries", params={"cursor": cursor})
    assert code_of(answer, 422) in {"invalid-cursor", "invalid-request"}


def test_a_cursor_that_was_altered_is_refused(idle: Service) -> None:
    surgery = idle.surgery()
    job = idle.submit(surgery, "PRE", pair("PRE"), idle.calibration())
    idle.client.post(f"/v1/jobs/{job}/cancel")
    idle.submit(surgery, "PRE", pair("PRE"), idle.calibration())
    wrong_times = ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-14:00", "2026-W01-1T00:00:00+00:00"]
    wrong_text = ["\ud800", "a\0"]
    for path, sort, texts in (
        ("/v1/surgeries", "created_at", wrong_times),
        ("/v1/surgeries", "reference", wrong_text),
        (f"/v1/surgeries/{surgery}/stages/PRE/takes", None, ["abc", "1.5", "9" * 30]),
    ):
        for _ in range(2):
            idle.surgery()
        parameters = {"limit": "1"} if sort is None else {"limit": "1", "sort": sort}
        cursor = idle.client.get(path, params=parameters).json()["next_cursor"]
        made_for, _, row = json.loads(base64.urlsafe_b64decode(cursor + "=="))
        for text in texts:
            altered = base64.urlsafe_b64encode(json.dumps([made_for, text, row]).encode()).decode()
            answer = idle.client.get(path, params={**parameters, "cursor": altered.rstrip("=")})
            assert code_of(answer, 422) == "invalid-cursor"


def test_a_cursor_of_another_list_is_refused(idle: Service) -> None:
    for _ in range(2):
        case(idle, "CUR-1")
    parameters = {"reference": "CUR-1", "limit": "1"}
    cursor = idle.client.get("/v1/surgeries", params=parameters).json()["next_cursor"]
    assert cursor is not None
    for other in ({"reference": "O-1"}, {"sort": "created_at"}, {"state": "queued"}):
        answer = idle.client.get("/v1/surgeries", params={**parameters, **other, "cursor": cursor})
        assert code_of(answer, 422) == "invalid-cursor"
    answer = idle.client.get("/v1/calibrations", params={"limit": "1", "cursor": cursor})
    assert code_of(answer, 422) == "invalid-cursor"


def test_an_unchanged_list_is_not_sent_again(idle: Service) -> None:
    case(idle, "TAG-1")
    path = "/v1/surgeries?reference=TAG-1"
    tag = idle.client.get(path).headers["etag"]
    same = idle.client.get(path, headers={"If-None-Match": tag})
    assert (same.status_code, same.content) == (304, b"")
    case(idle, "TAG-1")
    assert idle.client.get(path, headers={"If-None-Match": tag}).status_code == 200
