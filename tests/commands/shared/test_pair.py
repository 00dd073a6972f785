import json
from pathlib import Path

import pytest

from commands.shared.pair import measure_pair
from spinewatch.errors import ImageSizeError, SameImageError
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
LEFT, RIGHT = (D1 / "PRE" / f"{side}.png" for side in ("left", "right"))


def test_the_steps_of_a_measurement_are_timed() -> None:
    document = measure_pair(LEFT, RIGHT, D1 / "rig.json", (), "auto", None)
    assert list(document["timings_ms"]) == ["decode", "prepare", "detect", "match", "label", "total"]
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert list(document)[:3] == ["triads", "flags", "rig_check"]
    assert list(document)[-3:] == ["timings_ms", "parameters", "features"]


def test_the_size_is_checked_against_the_camera(tmp_path: Path) -> None:
    rig = json.loads((D1 / "rig.json").read_text())
    rig["right"]["image_size_px"] = [640, 480]
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(rig))
    with pytest.raises(ImageSizeError, match=r"right\.png is 568 x 416 px, .* 640 x 480 px"):
        measure_pair(LEFT, RIGHT, path, (), "auto", None)


def test_the_same_image_twice_is_an_error() -> None:
    with pytest.raises(SameImageError, match="are the same image"):
        measure_pair(LEFT, LEFT, D1 / "rig.json", (), "auto", None)
