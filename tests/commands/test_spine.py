"""`spinewatch spine`, `report` and `export`: the spine from files, as the service computes it."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from commands.main import app
from contract.summary import SurgerySummary
from tests.contract.spine_results import summary
from tests.paths import SAMPLES
from tests.store.builders import stage_result, triad

SETUP = SAMPLES / "D1" / "spine.json"
PLACES = {"L1": [0.0, 0.0, 0.0], "T11": [60.0, 2.0, 0.0], "T9": [120.0, 5.0, 0.0], "T7": [180.0, 0.0, 0.0]}
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Call `spinewatch` in a folder of its own; return exit status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["spinewatch", *map(str, arguments)])
        try:
            app()
            status: Any = 0
        except SystemExit as stop:
            status = stop.code or 0
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture
def stages(tmp_path: Path) -> list[str]:
    """Arguments of two stages; between them T9 moves by 3 mm."""
    arguments = []
    for name, moved in (("PRE", 0.0), ("POST", 3.0)):
        triads = [
            triad(label, position_mm=[x, y + moved * (label == "T9"), z])
            for label, (x, y, z) in PLACES.items()
        ]
        document = stage_result(triads).model_dump(mode="json")
        (tmp_path / f"{name}.json").write_text(json.dumps({**document, "timings_ms": {"total": 1.0}}))
        arguments.append(f"{name}={name}.json")
    return arguments


def test_the_summary_of_a_surgery_from_files(run: Run, stages: list[str]) -> None:
    status, out, err = run("spine", SETUP, *stages)
    assert (status, err) == (0, "")
    found = SurgerySummary.model_validate_json(out)
    assert [stage.name for stage in found.stages] == ["PRE", "POST"]
    assert found.vertebrae == ["T7", "T9", "T11", "L1"]
    post = found.stages[1].spine
    assert post is not None
    assert post.since_baseline is not None
    change = {item.vertebra: item.translation_mm for item in post.since_baseline.vertebrae}
    assert change["T9"] == pytest.approx([0.0, 3.0, 0.0], abs=1e-6)
    assert change["T7"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert found.stages[0].images.left.sha256 == ""


def test_images_are_hashed(run: Run, stages: list[str]) -> None:
    images = ",".join(str(SAMPLES / "D1" / "PRE" / f"{side}.png") for side in ("left", "right"))
    status, out, _ = run("spine", SETUP, f"{stages[0]},{images}", stages[1])
    assert status == 0
    left = SurgerySummary.model_validate_json(out).stages[0].images.left
    assert (len(left.sha256), left.width_px, left.media_type) == (64, 568, "image/png")


def test_tables(run: Run, stages: list[str], tmp_path: Path) -> None:
    status, out, _ = run("spine", SETUP, *stages, "--tables", "--out", "s.json")
    assert status == 0
    assert "cobb-fixed, curve 1" in out
    assert "assumed" in out
    assert SurgerySummary.model_validate_json((tmp_path / "s.json").read_text()).stages


def test_a_stage_without_the_reference_has_a_reason(run: Run, tmp_path: Path) -> None:
    document = stage_result([triad("T9")]).model_dump(mode="json")
    (tmp_path / "a.json").write_text(json.dumps(document))
    status, out, _ = run("spine", SETUP, "A=a.json", "--tables")
    assert status == 0
    assert "A: the reference triad L1 has no pose in the baseline stage A; label it there" in " ".join(
        out.split()
    )


def test_a_first_stage_without_the_reference_leaves_no_spine_to_the_others(
    run: Run, stages: list[str], tmp_path: Path
) -> None:
    before = json.loads((tmp_path / "PRE.json").read_text())
    before["triads"] = [item for item in before["triads"] if item["label"] != "L1"]
    (tmp_path / "PRE.json").write_text(json.dumps(before))
    _, out, _ = run("spine", SETUP, *stages)
    found = SurgerySummary.model_validate_json(out)
    assert [stage.spine for stage in found.stages] == [None, None]
    assert all("the baseline stage PRE" in str(stage.spine_reason) for stage in found.stages)
    named = {**json.loads(SETUP.read_text()), "baseline": "POST"}
    (tmp_path / "named.json").write_text(json.dumps(named))
    _, out, _ = run("spine", "named.json", *stages)
    spines = [stage.spine for stage in SurgerySummary.model_validate_json(out).stages]
    assert spines[0] is None
    assert spines[1] is not None
    assert spines[1].baseline.name == "POST"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.json", "PRE=PRE.json"), "none.json"),
        ((SETUP, "PRE.json"), "write it like PRE=pre.json"),
        ((SETUP, "PRE=PRE.json,left.png"), "write it like PRE=pre.json"),
        ((SETUP, "PRE=PRE.json", "PRE=POST.json"), "named twice"),
        ((SETUP, "PRE=none.json"), "none.json"),
        ((SETUP, f"PRE={SETUP}"), "spinewatch process"),
        ((SETUP, "PRE=PRE.json,none.png,none.png"), "none.png"),
        ((SETUP, f"PRE=PRE.json,{SETUP},{SETUP}"), "spine.json"),
        (("PRE.json", "PRE=PRE.json"), "is no setup of a spine"),
        (("open.json", "PRE=PRE.json"), "--reference"),
        (("late.json", "PRE=PRE.json"), "baseline: this surgery has no stage LATE"),
        ((SETUP, "PRE=PRE.json", "--reference", "T10"), "reference_vertebra: the reference T10"),
    ],
)
def test_what_cannot_be_used_is_one_line(
    run: Run, stages: list[str], tmp_path: Path, arguments: tuple[object, ...], words: str
) -> None:
    given = json.loads(SETUP.read_text())
    (tmp_path / "open.json").write_text(json.dumps({**given, "reference_vertebra": None}))
    (tmp_path / "late.json").write_text(json.dumps({**given, "baseline": "LATE"}))
    status, out, err = run("spine", *arguments)
    assert (status, out) == (2, "")
    assert err.startswith("spinewatch: ")
    assert len(err.splitlines()) == 1
    assert words in err


def test_a_report_from_a_file(run: Run, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(summary().model_dump_json())
    status, out, err = run("report", "--file", "s.json", "--out", "r.html")
    assert (status, out, err) == (0, "", "")
    page = (tmp_path / "r.html").read_text()
    assert page.lower().startswith("<!doctype html")
    assert "2026-0417" in page


def test_an_export_from_a_file(run: Run, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_text(summary().model_dump_json())
    assert run("export", "gltf", "--file", "s.json") == (0, "2026-0417.glb\n", "")
    assert (tmp_path / "2026-0417.glb").read_bytes()[:4] == b"glTF"
    status, out, err = run("export", "fhir", "--file", "s.json", "--out", "b.json")
    assert (status, out, err) == (0, "b.json\n", "")
    assert json.loads((tmp_path / "b.json").read_text())["resourceType"] == "Bundle"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export", "gltf"), "name either a surgery"),
        (("export", "gltf", "id", "--file", "s.json"), "name either a surgery"),
        (("export", "gltf", "--file", "none.json"), "none.json"),
        (("export", "paper", "--file", "s.json"), "choose one of"),
        (("export", "gltf", "--file", "s.json", "--stage", "NEVER"), "NEVER"),
        (("export", "gltf", "id", "--url", "http://127.0.0.1:9"), "is the service running"),
        (("report", "--out", "r.html"), "name either a surgery"),
        (("report", "--file", "s.json", "--out", "none/r.html"), "none/r.html"),
    ],
)
def test_what_cannot_be_written_is_one_line(
    run: Run, tmp_path: Path, arguments: tuple[object, ...], words: str
) -> None:
    (tmp_path / "s.json").write_text(summary().model_dump_json())
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert err.startswith("spinewatch: ")
    assert len(err.splitlines()) == 1
    assert words in err


def test_one_result_as_two_stages_is_flagged(run: Run, stages: list[str]) -> None:
    status, out, err = run("spine", SETUP, stages[0], "POST=PRE.json")
    assert (status, err) == (0, "")
    pre, post = SurgerySummary.model_validate_json(out).stages
    assert "frame-repeated" not in [flag.code for flag in pre.flags or ()]
    assert "frame-repeated" in [flag.code for flag in post.flags or ()]
    _, out, _ = run("spine", SETUP, stages[0], "POST=PRE.json", "--tables")
    assert "POST: the result is that of stage PRE again" in " ".join(out.split())


def test_a_setup_of_any_name_is_read(run: Run, stages: list[str], tmp_path: Path) -> None:
    for name in (b"a\xff.json", b"a\nb.json"):
        path = tmp_path / os.fsdecode(name)
        path.write_bytes(SETUP.read_bytes())
        status, out, _ = run("spine", path, *stages)
        assert status == 0
        assert SurgerySummary.model_validate_json(out).reference in {"a\\xff", "a b"}
