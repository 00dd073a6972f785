import json
from pathlib import Path

import pytest
from PIL import Image

from commands.shared.pair import measure_pair
from contract.explanation import Explanation
from contract.features import FeaturePair
from spinewatch.errors import ImageSizeError, SameImageError
from spinewatch.stage import StageRequest
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
LEFT, RIGHT = (D1 / "PRE" / f"{side}.png" for side in ("left", "right"))
STEPS = ("activity", "candidates", "feature-space", "tone")


def test_the_steps_of_a_measurement_are_timed() -> None:
    document = measure_pair(LEFT, RIGHT, D1 / "rig.json", StageRequest())
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
        measure_pair(LEFT, RIGHT, path, StageRequest())


def test_the_same_image_twice_is_an_error() -> None:
    with pytest.raises(SameImageError, match="are the same image"):
        measure_pair(LEFT, LEFT, D1 / "rig.json", StageRequest())


def test_the_steps_and_the_candidates_are_written(tmp_path: Path) -> None:
    measure_pair(LEFT, RIGHT, D1 / "rig.json", StageRequest(), None, tmp_path / "explained")
    names = [f"{side}-{step}.png" for side in ("left", "right") for step in STEPS]
    assert sorted(path.name for path in (tmp_path / "explained").iterdir()) == [
        "explanation.json",
        *sorted(names),
    ]
    document = json.loads((tmp_path / "explained" / "explanation.json").read_text())
    explanation = Explanation.model_validate_json(json.dumps(document["explanation"]))
    features = FeaturePair.model_validate_json(json.dumps(document["features"]))
    assert len(explanation.left.features) == len(features.left)
    assert sum(triad.reason is None for triad in explanation.triads) == len(document["labels"]) == 4
    with Image.open(tmp_path / "explained" / "left-candidates.png") as drawn:
        assert (drawn.size, drawn.mode) == ((3 * 568, 3 * 416), "RGB")
    with Image.open(tmp_path / "explained" / "right-tone.png") as tone:
        assert tone.size == (568, 416)
