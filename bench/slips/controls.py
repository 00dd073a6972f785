"""Sound input: the samples as they are, and forms of them that must be read without a flag."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from bench.slips.images import measured_well
from bench.slips.slip import ROUTINE_FLAGS, Answer, Right, Slip
from bench.slips.sound import (
    BOARD,
    SAMPLES,
    STAGES,
    board_files,
    csv_text,
    point_tables,
    process_arguments,
    rig,
    stage_files,
)


def controls() -> Iterator[Slip]:
    """Yield the sound input."""
    for stage in STAGES:
        yield Slip(f"stage {stage}", "sound", stage, "process", Right(sound=_four), _stage(stage))
        unnamed = _stage(stage, labels=None, more=("--triads", 4))
        yield Slip(f"stage {stage} without names", "sound", stage, "process", Right(sound=_four), unnamed)
    for trial in "ABCF":
        yield Slip(f"board {trial}", "sound", trial, "calibrate", Right(sound=_calibrated), _boards(trial))
    yield Slip(
        "boards C and A, verified by B",
        "sound",
        "CAB",
        "calibrate",
        Right(sound=_calibrated),
        _boards("CAB", 1),
    )
    yield Slip("point tables", "sound", "simulated table", "calibrate", Right(sound=_calibrated), _points)
    real = Right(flags=("control-point-removed",), sound=_calibrated)
    yield Slip("chessboards of OpenCV's sample", "sound", "chessboards", "calibrate", real, _chessboards)
    for form in ("opencv", "1995", "openptv"):
        yield Slip(
            f"rig through {form}", "sound", "D1 rig", "convert", Right(sound=_same_rig), _through(form)
        )


def _unflagged(answer: Answer) -> bool:
    return not answer.codes - ROUTINE_FLAGS


def _four(answer: Answer) -> bool:
    return _unflagged(answer) and measured_well(answer)


def _calibrated(answer: Answer) -> bool:
    return _unflagged(answer) and "rig" in answer.document


def _same_rig(answer: Answer) -> bool:
    return "baseline 421.9" in answer.message


def _stage(
    stage: str, labels: str | None = "L1,T11,T9,T7", more: Sequence[object] = ()
) -> Callable[[Path], Sequence[object]]:
    return lambda _: [*process_arguments(stage_files(stage), labels=labels), *more]


def _boards(trials: str, verify: int = 0) -> Callable[[Path], Sequence[object]]:
    files = [file for trial in trials for file in board_files(trial)]
    return lambda _: [*files, "--control-field", BOARD, "--verify", verify]


def _points(folder: Path) -> Sequence[object]:
    paths = [folder / "left.csv", folder / "right.csv"]
    for path, table in zip(paths, point_tables(rig()), strict=True):
        path.write_text(csv_text(table))
    return [*paths, "--image-size", "568x416"]


def _chessboards(_: Path) -> Sequence[object]:
    boards = SAMPLES / "calibration" / "chessboards"
    return [boards / "left.csv", boards / "right.csv", "--image-size", "640x480", "--pixel-size", "0.01,0.01"]


def _through(form: str) -> Callable[[Path], Sequence[object]]:
    def make(folder: Path) -> Sequence[object]:
        from bench.slips.run import run_command  # noqa: PLC0415 - only here

        target = folder if form == "openptv" else folder / f"rig.{form}"
        run_command("convert", [SAMPLES / "D1" / "rig.json", "--to", form, "--out", target])
        return [target, "--from", form, "--out", folder / "out.json"]

    return make
