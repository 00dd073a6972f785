"""Bad input to any command: one line on stderr and exit status 2."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from commands.main import app
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
RIG = D1 / "rig.json"
LEFT, RIGHT = D1 / "PRE" / "left.png", D1 / "PRE" / "right.png"


def refusal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: tuple[object, ...]
) -> str:
    """Return the line that the command prints on stderr."""
    monkeypatch.setattr(sys, "argv", ["spinewatch", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        app()
    out, err = capsys.readouterr()
    assert (stopped.value.code, out) == (2, "")
    assert err.startswith("spinewatch: ")
    assert len(err.splitlines()) == 1
    return err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("process", "none.png", RIGHT, "--rig", RIG), "none.png"),
        (("process", LEFT, RIGHT, "--rig", SAMPLES), "samples"),
        (("calibrate", LEFT, RIGHT), "--control-field"),
        (("calibrate", LEFT, "--control-field", "pegboard-1995"), "1 image files"),
        (("calibrate", "none.csv", "--image-size", "568x416"), "none.csv"),
        (("convert", "none.json", "--out", "rig.json"), "none.json"),
        (("convert", RIG, "--out", "none/rig.json"), "none/rig.json"),
        (("convert", RIG, "--from", "openptv", "--out", "rig.json"), "left.ori"),
        (("simulate", "scenes", "--rig", "none.json"), "none.json"),
        (("simulate", "file/scenes", "--rig", RIG), "cannot create"),
        (("templates", "build", "none", "--rig", RIG, "--out", "t.npz", "--version", "v"), "none/left.png"),
        (("templates", "build", D1, "--rig", "none.json", "--out", "t.npz", "--version", "v"), "none.json"),
        (("templates", "build", "bad", "--rig", RIG, "--out", "t.npz", "--version", "v"), "bad/truth.json"),
        (("templates", "build", "text", "--rig", RIG, "--out", "t.npz", "--version", "v"), "text/left.png"),
        (("sample", "--samples", "none"), "none"),
    ],
)
def test_what_is_wrong_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[object, ...],
    words: str,
) -> None:
    (tmp_path / "file").touch()
    for name in ("bad", "text"):
        shutil.copytree(D1 / "PRE", tmp_path / name)
    (tmp_path / "bad" / "truth.json").write_text('{"triads": [{}]}')
    (tmp_path / "text" / "left.png").write_text("text")
    monkeypatch.chdir(tmp_path)
    assert words in refusal(monkeypatch, capsys, arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("convert", RIG, "--out", "x.foo"), ".json"),
        (("convert", RIG, "--to", "opencv", "--out", "x.json"), ".yml"),
        (("convert", RIG, "--to", "1995", "--out", "x.json"), ".dat"),
        (("report", "none", "--out", "r.docx"), ".html, .htm or .pdf"),
        (("report", "none", "--out", "r"), ".html, .htm or .pdf"),
        (("calibrate", LEFT, RIGHT, "--report", "r.docx"), ".html or .htm"),
        (("calibrate", LEFT, RIGHT, "--out", "r.yml"), ".json"),
        (("detect", LEFT, "--out", "F.DAT", "--ball", "1e5,1e5"), "--ball"),
        (("process", LEFT, RIGHT, "--rig", RIG, "--range", "1,1e300"), "--range"),
    ],
)
def test_a_name_or_number_that_cannot_be_meant_is_refused_before_anything_is_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[object, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in refusal(monkeypatch, capsys, arguments)
    assert list(tmp_path.iterdir()) == []
