import json
from pathlib import Path

import pytest

from commands.shared.files import InputError
from commands.shared.spine_files import (
    StageContent,
    parse_stages,
    read_radiographs,
    read_setup,
    read_stages,
    summarize,
)
from contract.spine_setup import StoredSpineSetup
from spinewatch.errors import ParameterError, SameImageError
from tests.paths import SAMPLES
from tests.store.builders import NOON, spine_setup, stage_result, triad, without_pose


def test_stages_of_a_command_line() -> None:
    plain, full = parse_stages(["PRE=a.json", "POST=b.json,l.png,r.png"])
    assert (plain.name, plain.result, plain.images) == ("PRE", Path("a.json"), None)
    assert (full.name, full.result, full.images) == ("POST", Path("b.json"), (Path("l.png"), Path("r.png")))


@pytest.mark.parametrize("argument", ["", "PRE", "=a.json", "PRE=", "PRE=a,b", "PRE=a,b,c,d"])
def test_what_names_no_stage(argument: str) -> None:
    with pytest.raises(ParameterError, match="write it like"):
        parse_stages([argument])


@pytest.mark.parametrize(
    "name", ["PRE 1", "a/../b", "-", ".", "PRE\n", "\x1b[31m", "\udcff", "x" * 65, "\xe4"]
)
def test_a_name_that_no_stage_of_the_service_has(name: str) -> None:
    with pytest.raises(ParameterError, match="cannot be the name of a stage"):
        parse_stages([f"{name}=a.json"])


def codes(stage: StageContent) -> list[str]:
    """Return the codes of the flags of a stage."""
    return [flag.code for flag in stage.flags]


def test_an_equal_result_and_equal_images_are_flagged(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(stage_result([triad("L1")]).model_dump_json())
    (tmp_path / "b.json").write_text(
        stage_result([triad("L1", position_mm=[1.5, 2.0, 3.0])]).model_dump_json()
    )
    a, b = tmp_path / "a.json", tmp_path / "b.json"
    left, right = (SAMPLES / "D1" / "PRE" / f"{side}.png" for side in ("left", "right"))
    pre, post = read_stages(parse_stages([f"PRE={a}", f"POST={a}"]))
    assert ["frame-repeated" in codes(stage) for stage in (pre, post)] == [False, True]
    images = f"{left},{right}"
    pre, post = read_stages(parse_stages([f"PRE={a},{images}", f"POST={b},{images}"]))
    assert ["frame-repeated" in codes(stage) for stage in (pre, post)] == [False, True]
    with pytest.raises(SameImageError, match="same image"):
        read_stages(parse_stages([f"PRE={a},{left},{left}"]))


@pytest.mark.parametrize("version", ["null", "1", '"\\ud800"', "[" * 900 + "]" * 900])
def test_a_result_without_a_version(tmp_path: Path, version: str) -> None:
    text = stage_result([triad("L1")]).model_dump_json()
    document = {**json.loads(text), "version": "VERSION"}
    (tmp_path / "a.json").write_text(json.dumps(document).replace('"VERSION"', version))
    with pytest.raises(InputError, match="is no result of a stage"):
        read_stages(parse_stages([f"PRE={tmp_path / 'a.json'}"]))


def test_poses_of_a_result(tmp_path: Path) -> None:
    result = stage_result([triad("L1"), triad(None), without_pose("T9")])
    (tmp_path / "a.json").write_text(result.model_dump_json())
    (content,) = read_stages(parse_stages([f"PRE={tmp_path / 'a.json'}"]))
    assert list(content.poses()) == ["L1"]
    assert (content.triads, content.flags, content.version) == (result.triads, result.flags, result.version)


def test_a_stored_setup_keeps_its_rebaselines(tmp_path: Path) -> None:
    again = {"vertebra": "T9", "before": "PRE", "after": "POST", "created_at": NOON}
    stored = StoredSpineSetup.model_validate(
        {"surgery_id": "s", "revision": 2, "created_at": NOON, "setup": spine_setup(), "rebaselines": [again]}
    )
    (tmp_path / "stored.json").write_text(stored.model_dump_json())
    (tmp_path / "plain.json").write_text(spine_setup().model_dump_json())
    assert read_setup(tmp_path / "stored.json") == (stored.setup, stored.rebaselines)
    assert read_setup(tmp_path / "plain.json") == (spine_setup(), [])


@pytest.mark.parametrize("text", ["[]", "{}", '{"setup": 1}', json.dumps({"triads": []})])
def test_what_is_no_setup(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match="is no setup of a spine"):
        read_setup(tmp_path / "a.json")


def test_the_option_names_another_reference(tmp_path: Path) -> None:
    places = {"T9": 120.0, "T11": 60.0, "L1": 0.0}
    triads = [triad(label, position_mm=[x, 0.0, 0.0]) for label, x in places.items()]
    (tmp_path / "a.json").write_text(stage_result(triads).model_dump_json())
    (tmp_path / "setup.json").write_text(spine_setup(reference_vertebra="L1").model_dump_json())
    stages = parse_stages([f"PRE={tmp_path / 'a.json'}"])
    for option, expected in ((None, "L1"), ("t09", "T9")):
        found = summarize(tmp_path / "setup.json", stages, option)
        assert found.reference_vertebra == expected
        assert found.stages[0].spine is not None
        assert found.stages[0].spine.reference_vertebra == expected


def test_radiographs_of_the_service(tmp_path: Path) -> None:
    image = {"sha256": "a", "media_type": "image/png", "width_px": 1, "height_px": 1, "size_bytes": 1}
    given = {
        "id": "a", "surgery_id": "s", "view": "pa", "positive_on": "left", "pixel_spacing_mm": [0.5, 0.25],
        "spacing_source": "given", "image": image, "created_at": NOON.isoformat(),
    }  # fmt: skip
    (tmp_path / "pa.json").write_text(json.dumps(given))
    (found,) = read_radiographs([tmp_path / "pa.json"])
    assert (found.id, found.view, found.pixel_spacing_mm) == ("a", "pa", [0.5, 0.25])
    (tmp_path / "pa.json").write_text("{}")
    with pytest.raises(InputError, match="is no description of a radiograph"):
        read_radiographs([tmp_path / "pa.json"])
