"""`spinewatch process`: the JSON of a pair, and one clear line for each kind of bad input."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from commands.main import app
from contract.features import Feature
from contract.stage import StageResult
from spinewatch.detection.candidates.templates import default_template_set, write_template_set
from tests.paths import PROJECT

D1 = PROJECT / "samples" / "D1"
STAGE = D1 / "PRE"
LABELS = "L1,T11,T9,T7"

Outcome = tuple[int, str, str]
Run = Callable[..., Outcome]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Call `spinewatch process` and return exit status, stdout, stderr."""

    def call(*arguments: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["spinewatch", "process", *map(str, arguments)])
        try:
            app()
            status: Any = 0
        except SystemExit as stop:
            status = stop.code or 0
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """A writable copy of one stage with its rig."""
    for name in ("left.png", "right.png"):
        shutil.copy(STAGE / name, tmp_path)
    shutil.copy(D1 / "rig.json", tmp_path)
    return tmp_path


def arguments(folder: Path, *more: object) -> Sequence[object]:
    return [folder / "left.png", folder / "right.png", "--rig", folder / "rig.json", *more]


def refused(outcome: Outcome, *words: str) -> None:
    status, out, err = outcome
    assert status == 2
    assert out == ""
    assert err.startswith("spinewatch: ")
    assert len(err.splitlines()) == 1
    for word in words:
        assert word in err


@pytest.mark.parametrize("stage", ["PRE", "INTER", "POST"])
def test_finds_every_triad_of_the_sample_in_label_order(run: Run, stage: str) -> None:
    folder = D1 / stage
    options = ["--triads", 4, "--labels", LABELS, "--spine-axis", "x"]
    status, out, err = run(folder / "left.png", folder / "right.png", "--rig", D1 / "rig.json", *options)
    assert (status, err) == (0, "")
    document = json.loads(out)
    truth = json.loads((folder / "truth.json").read_text())["triads"]
    assert [triad["label"] for triad in document["triads"]] == LABELS.split(",")
    for triad, true in zip(document["triads"], truth, strict=True):
        assert np.linalg.norm(np.subtract(triad["position_mm"], true["P_mm"])) < 2
        assert np.dot(triad["normal"], true["normal"]) > np.cos(np.radians(8))
        R = np.array(triad["rotation"])
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(R[:, 2], triad["normal"], atol=1e-9)
        assert list(triad["balls"]) == ["XX", "YY", "MX"]


def test_document_has_the_promised_shape(run: Run) -> None:
    status, out, _ = run(*arguments_of_sample())
    assert status == 0
    document = json.loads(out)
    assert set(document) == {*StageResult.model_fields, "timings_ms"}
    assert document["templates"] == default_template_set().version
    assert set(Feature.model_fields) == set(document["features"]["left"][0])
    assert all(ms >= 0 for ms in document["timings_ms"].values())
    steps = [ms for step, ms in document["timings_ms"].items() if step != "total"]
    assert document["timings_ms"]["total"] == pytest.approx(sum(steps), abs=1)
    triad = document["triads"][0]
    assert np.shape(triad["rotation"]) == (3, 3)
    assert np.shape(triad["covariance"]) == (6, 6)
    assert np.shape(triad["balls"]["XX"]["left"]) == (2,)


def arguments_of_sample(*more: object) -> Sequence[object]:
    return [STAGE / "left.png", STAGE / "right.png", "--rig", D1 / "rig.json", "--labels", LABELS, *more]


def test_a_template_set_is_chosen_by_its_file(run: Run, tmp_path: Path) -> None:
    built_in = tmp_path / "templates.npz"
    built_in.write_bytes(write_template_set(default_template_set()))
    chosen = json.loads(run(*arguments_of_sample("--templates", built_in))[1])
    default = json.loads(run(*arguments_of_sample())[1])
    for document in (chosen, default):
        del document["timings_ms"]
    assert chosen == default


@pytest.mark.parametrize("content", [None, b"", b"not a template set"])
def test_a_file_that_is_not_a_template_set(run: Run, tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "templates.npz"
    if content is not None:
        path.write_bytes(content)
    refused(run(*arguments_of_sample("--templates", path)), "templates.npz")


def test_same_input_gives_the_same_bits(run: Run) -> None:
    def result() -> dict[str, Any]:
        document: dict[str, Any] = json.loads(run(*arguments_of_sample())[1])
        del document["timings_ms"]
        return document

    assert result() == result()


def test_out_writes_the_document(run: Run, tmp_path: Path) -> None:
    status, out, _ = run(*arguments_of_sample("--out", tmp_path / "result.json"))
    assert (status, out) == (0, "")
    assert json.loads((tmp_path / "result.json").read_text())["triads"]


def test_works_as_a_program_of_its_own(pair: Path) -> None:
    command = [sys.executable, "-c", "from commands.main import app; app()", "process", *arguments(pair)]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, cwd=PROJECT)
    assert done.returncode == 0
    assert done.stderr == ""
    assert json.loads(done.stdout)["features"]["left"]


def test_missing_image(run: Run, pair: Path) -> None:
    (pair / "left.png").unlink()
    refused(run(*arguments(pair)), "cannot read", "left.png", "No such file")


def test_folder_instead_of_an_image(run: Run, pair: Path) -> None:
    refused(run(pair, pair / "right.png", "--rig", pair / "rig.json"), "cannot read", "directory")


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\n"])
def test_not_an_image(run: Run, pair: Path, content: bytes) -> None:
    (pair / "right.png").write_bytes(content)
    refused(run(*arguments(pair)), "right.png")


def test_truncated_image(run: Run, pair: Path) -> None:
    (pair / "left.png").write_bytes((STAGE / "left.png").read_bytes()[:90_000])
    refused(run(*arguments(pair)), "left.png", "damaged or incomplete")


def test_range_markers_and_refinement_reach_the_parameters(run: Run, pair: Path) -> None:
    more = ["--range", "600,900", "--marker", "flat:18,14,10", "--marker", "orthogonal:20,14,9", "--refine"]
    status, out, err = run(*arguments(pair, "--labels", LABELS, *more))
    assert status == 0, err
    document = json.loads(out)
    matching = document["parameters"]["search"]["matching"]
    assert matching["epipolar"]["range_mm"] == [600.0, 900.0]
    assert matching["refinement"]["enabled"] is True
    assert {triad["model"] for triad in document["triads"]} <= {"flat-10-14-18", "orthogonal-20-14-9"}


def test_an_earlier_stage_decides_on_labels_when_a_triad_is_missing(
    run: Run, pair: Path, tmp_path: Path
) -> None:
    earlier = tmp_path / "pre.json"
    assert run(*arguments(pair, "--labels", LABELS, "--spine-axis", "x", "--out", earlier))[0] == 0
    labels = [triad["label"] for triad in json.loads(earlier.read_text())["triads"]]
    assert labels == LABELS.split(",")
    image = np.array(Image.open(pair / "left.png"))
    hidden = next(t for t in json.loads(earlier.read_text())["triads"] if t["label"] == "T11")
    for ball in hidden["balls"].values():
        u, v = (round(x) for x in ball["left"])
        image[v - 9 : v + 10, u - 9 : u + 10] = 120
    Image.fromarray(image).save(pair / "left.png")
    status, out, _ = run(*arguments(pair, "--labels", LABELS, "--spine-axis", "x", "--earlier", earlier))
    assert status == 0
    found_labels = {triad["label"] for triad in json.loads(out)["triads"]}
    assert found_labels - {None} == {"L1", "T9", "T7"}


@pytest.mark.parametrize(
    ("option", "value", "problem"),
    [
        ("--range", "900,600", "nearest and the farthest"),
        ("--range", "600", "nearest and the farthest"),
        ("--marker", "round", "not known"),
        ("--marker", "cube:1,2,3", "none of"),
        ("--marker", "flat:1,2", "must have 3 numbers"),
        ("--marker", "flat:18,-14,10", "lengths above 0"),
        ("--marker", "flat:a,b,c", "must have 3 numbers"),
        ("--earlier", "rig.json", "is not a stage"),
    ],
)
def test_what_is_known_wrongly_is_refused(
    run: Run, pair: Path, option: str, value: str, problem: str
) -> None:
    refused(run(*arguments(pair, option, pair / value if option == "--earlier" else value)), problem)


def test_truncated_tiff_prints_no_other_line(run: Run, pair: Path) -> None:
    Image.open(STAGE / "left.png").save(pair / "whole.tiff")
    (pair / "left.png").write_bytes((pair / "whole.tiff").read_bytes()[:150_000])
    refused(run(*arguments(pair)), "left.png")


def test_size_differs_from_the_rig(run: Run, pair: Path) -> None:
    Image.open(STAGE / "right.png").resize((640, 480)).save(pair / "right.png")
    refused(run(*arguments(pair)), "right.png", "640 x 480", "568 x 416")


def test_same_file_twice(run: Run, pair: Path) -> None:
    refused(run(pair / "left.png", pair / "left.png", "--rig", pair / "rig.json"), "same image")


def test_same_pixels_in_two_formats(run: Run, pair: Path) -> None:
    Image.open(pair / "left.png").save(pair / "right.tiff")
    refused(run(pair / "left.png", pair / "right.tiff", "--rig", pair / "rig.json"))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("left.focal_length_mm", None),
        ("right.principal_point_mm", [0.018]),
        ("right.position_mm", [1.0, 2.0, "3"]),
        ("left.radial", [float("nan"), 0.0]),
        ("left.rotation_deg", [float("inf"), 0.0, 0.0]),
        ("right.image_size_px", [568.5, 416]),
    ],
)
def test_rig_with_a_missing_or_unusable_number(run: Run, pair: Path, field: str, value: object) -> None:
    rig = json.loads((pair / "rig.json").read_text())
    side, key = field.split(".")
    if value is None:
        del rig[side][key]
    else:
        rig[side][key] = value
    (pair / "rig.json").write_text(json.dumps(rig))
    refused(run(*arguments(pair)), field, "rig.json")


def test_rig_that_is_not_json(run: Run, pair: Path) -> None:
    (pair / "rig.json").write_text("{")
    refused(run(*arguments(pair)), "rig.json", "not JSON")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--triads", "0"], ["--triads", "give 1 to 30"]),
        (["--triads", "-3"], ["--triads", "give 1 to 30"]),
        (["--labels", "L1,T11,L1"], ["twice"]),
        (["--labels", "L1,,T9"], ["empty"]),
        (["--labels", ""], ["empty"]),
        (["--labels", "L1,T11", "--triads", "3"], ["2 names", "3"]),
    ],
)
def test_labels_and_count(run: Run, options: list[str], words: list[str]) -> None:
    refused(run(STAGE / "left.png", STAGE / "right.png", "--rig", D1 / "rig.json", *options), *words)


def test_unknown_axis_and_missing_rig_are_usage_errors(run: Run) -> None:
    assert run(*arguments_of_sample("--spine-axis", "z"))[0] == 2
    assert run(STAGE / "left.png", STAGE / "right.png")[0] == 2


def test_unwritable_out(run: Run, tmp_path: Path) -> None:
    refused(run(*arguments_of_sample("--out", tmp_path / "missing" / "x.json")), "cannot write", "x.json")


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        ("L1,T9,T11,T7", "order of the spine"),
        ("L1,L9", "L9"),
        ("L1,l01", "twice"),
        ("T13,T12", "extra level"),
    ],
)
def test_vertebrae_that_no_spine_has_are_refused(run: Run, pair: Path, labels: str, words: str) -> None:
    refused(run(*arguments(pair, "--labels", labels)), words)


def test_labels_that_the_distances_contradict_are_null(run: Run, pair: Path) -> None:
    options = ["--labels", "L2,T13,T11,T10", "--extra-levels", "t13", "--spine-axis", "x"]
    status, out, _ = run(*arguments(pair, *options))
    document = json.loads(out)
    assert status == 0
    assert "levels-implausible" in {flag["code"] for flag in document["flags"]}
    assert {triad["label"] for triad in document["triads"]} == {None}


def test_the_method_of_1995_gives_the_same_document_and_its_files(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "explained"
    more = ["--method", "thesis-1995", "--size-reduction", "none", "--no-refine", "--explain", folder]
    status, out, err = run(*arguments_of_sample(*more))
    assert (status, err) == (0, "")
    document = json.loads(out)
    assert list(document) == list(json.loads(run(*arguments_of_sample())[1]))
    parameters = document["parameters"]
    assert parameters["method"] == "thesis-1995"
    assert parameters["detection"]["preprocessing"]["statistic"] is None
    assert parameters["sets"]["refine"] is False
    assert document["triads"]
    assert all(min(triad["position_sd_mm"]) > 0.05 for triad in document["triads"])
    explanation = json.loads((folder / "explanation.json").read_text())["explanation"]
    assert explanation["method"] == "thesis-1995"
    verdicts = [line.split()[-1] for line in (folder / "Triplets.dat").read_text().splitlines()[1:]]
    told = [triad["heuristic"] or "P" for triad in explanation["triads"]]
    assert sorted(verdicts) == sorted(told)
    for side in ("left", "right"):
        for name in ("pre", "edge", "crossGl", "crossEd", "final"):
            with Image.open(folder / f"{side}-{name}.ras") as image:
                assert image.width == 568
    written = {path.name for path in folder.iterdir()}
    assert {
        "CandidateSets.dat",
        "MatchCoords.dat",
        "SpacoOUT.dat",
        "SpineStage.dat",
        "sets-left-01.png",
    } <= written


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--size-reduction", "none"], ["--method thesis-1995"]),
        (["--method", "thesis-1995", "--marker", "orthogonal:20,14,9"], ["does not know the marker"]),
        (["--method", "thesis-1995", "--range", "900,600"], ["nearest and the farthest"]),
    ],
)
def test_options_that_a_method_has_not(run: Run, pair: Path, more: list[str], words: list[str]) -> None:
    refused(run(*arguments(pair, *more)), *words)


def test_the_method_of_1995_reads_its_own_templates(run: Run, tmp_path: Path) -> None:
    wrong = tmp_path / "templates.npz"
    wrong.write_bytes(write_template_set(default_template_set()))
    refused(
        run(*arguments_of_sample("--method", "thesis-1995", "--templates", wrong)),
        "templates.npz",
        "build-1995",
    )
