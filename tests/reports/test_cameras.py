import re
from copy import deepcopy
from typing import Any

from reports.cameras import cameras_report

Document = dict[str, Any]


def test_every_camera_and_pair_is_in_the_report(cameras: Document) -> None:
    page = cameras_report(cameras)
    assert "<title>Calibration of 3 cameras</title>" in page
    assert "<th>cam3</th><th>±</th><th>cam4</th><th>±</th><th>cam1</th><th>±</th>" in page
    printed = re.findall(r"<td>(\w+ and \w+)</td>", page)
    assert printed == [" and ".join(pair["cameras"]) for pair in cameras["pairs"] for _ in pair["shots"]]
    assert not re.search(r"&amp;(#|[a-z]+;)", page)


def test_one_camera_has_no_reconstruction(cameras: Document) -> None:
    (name,) = (camera["name"] for camera in cameras["cameras"][:1])
    document = {
        **cameras,
        "cameras": cameras["cameras"][:1],
        "quality": {name: cameras["quality"][name]},
        "pairs": [],
    }
    page = cameras_report(document)
    assert "<title>Calibration of 1 camera</title>" in page
    assert "No two cameras have points in common." in page


def test_the_name_of_a_camera_is_escaped(cameras: Document) -> None:
    document = deepcopy(cameras)
    document["cameras"][0]["name"] = "<b>cam</b>"
    document["quality"]["<b>cam</b>"] = document["quality"]["cam3"]
    page = cameras_report(document)
    assert "<b>" not in page
    assert "&lt;b&gt;cam&lt;/b&gt;" in page
