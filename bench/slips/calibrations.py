"""Slips of calibrating from images of the peg board: order, swaps, fields, copies."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from bench.slips.slip import Answer, Kind, Right, Slip
from bench.slips.sound import (
    BOARD,
    BOARDS,
    SIDES,
    Table,
    board_files,
    columns_changed,
    csv_text,
    field_table,
    pixels,
    stage_files,
    write_png,
)

_FIELD = ("--control-field", BOARD)


def slips() -> Iterator[Slip]:
    """Yield the slips of calibrating from images."""
    yield from _orders()
    yield from _copies()
    yield from _fields()


def _orders() -> Iterator[Slip]:
    listed = Right(refusal=r"agree|order|left.*right")
    for trials in ("CA", "BF", "CABF"):
        files = [BOARDS / trial / f"{side}.png" for side in SIDES for trial in trials]
        yield _files(f"all left ones before all right ones, shots {trials}", "order", trials, files, listed)
    exchanged = Right(refusal=r"exchange|swap|order|agree")
    one = [*board_files("C"), *reversed(board_files("A"))]
    yield _files("left and right of the second shot exchanged", "swap", "CA", one, exchanged)
    yield _files(
        "left and right of the only shot exchanged", "swap", "B", [*reversed(board_files("B"))], exchanged
    )
    mixed = Right(refusal=r"agree|moment|belong|fit", flags=("calibration-poor",))
    crossed = [board_files("C")[0], board_files("A")[1], board_files("A")[0], board_files("C")[1]]
    yield _files("the left ones of two shots exchanged", "swap", "CA", crossed, mixed)
    late = [*board_files("C"), board_files("A")[0], board_files("B")[1]]
    yield _files("a second shot whose sides are of two moments", "swap", "CAB", late, mixed)
    other = Right(refusal=r"not found|no target|targets", flags=("shot-left-out",))
    yield _files("a stage among the shots", "order", "C", [*board_files("C"), *stage_files("PRE")], other)


def _copies() -> Iterator[Slip]:
    once = Right(refusal=r"same|twice|copy|once", flags=("shot-repeated",))
    yield _copied("the shot used verifies itself", "C", _copy, once, verify=True)
    yield _copied("its copy as TIFF verifies a shot", "A", _as_tiff, once, verify=True)
    yield _copied("its copy with other noise verifies a shot", "B", _with_noise, once, verify=True)
    yield _copied("a shot used twice", "F", _as_tiff, once, verify=False)
    same = Right(refusal=r"same|also")
    yield _files("the left image as both sides", "swap", "C", [board_files("C")[0]] * 2, same)


def _fields() -> Iterator[Slip]:
    unit = Right(refusal=r"metre|unit|baseline|_mm")
    for name, factor in (("metres", 0.001), ("inches", 1 / 25.4), ("centimetres", 0.1)):
        yield _field(f"control field in {name}", "unit", "C", _scaled(factor), unit)
    commas = Right(refusal=r"line \d+.*(fields|columns|comma)|(fields|columns|comma).*line \d+")
    yield _field("control field with decimal commas", "table", "A", _decimal_commas, commas)
    twice = Right(refusal=r"z_mm.*twice|twice.*z_mm")
    yield _field("control field with a column twice", "table", "B", _column_twice, twice)
    mirrored = Right(refusal=r"mirror")
    yield _field("control field with x and y exchanged", "order", "C", _exchanged, mirrored)
    upside = Right(refusal=r"upside|Z|reversed")
    yield _field("heights of the control field downwards", "order", "F", _downwards, upside)
    peg = Right(
        refusal=r"contradict|fit", flags=("control-point-removed", "calibration-poor"), sound=_baseline_holds
    )
    yield _field("one peg mistyped by 30 mm", "table", "C", _one_peg, peg)
    scaled = Right(refusal=r"fit|plane|height", flags=("calibration-poor",))
    yield _field("heights of the control field in inches", "unit", "A", _heights_in_inches, scaled)
    pixel = Right(refusal=r"pixel.?size|micrometre", flags=("pixel-size-doubtful",))
    files = [*board_files("C"), *board_files("A")]
    for name, value in (
        ("in micrometres", "10,8.45"),
        ("of a square pixel", "0.01,0.01"),
        ("exchanged", "0.00845,0.01"),
    ):
        options = (*_FIELD, "--pixel-size", value)
        yield _files(f"pixel size {name}, from images", "unit", "C", files, pixel, options)


def _files(
    name: str,
    kind: Kind,
    trials: str,
    files: Sequence[Path],
    right: Right,
    options: Sequence[object] = _FIELD,
) -> Slip:
    return Slip(name, kind, trials, "calibrate", right, lambda _: [*files, *options])


def _copied(
    name: str, trial: str, copy: Callable[[Path, Path], object], right: Right, *, verify: bool
) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        copies = []
        for side, file in zip(SIDES, board_files(trial), strict=True):
            copies.append(folder / f"{side}.img")
            copy(file, copies[-1])
        more = ["--verify", 1] if verify else []
        return [*board_files(trial), *copies, *_FIELD, *more]

    return Slip(name, "calibration", trial, "calibrate", right, make)


def _field(name: str, kind: Kind, trial: str, write: Callable[[Table], str], right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        path = folder / "board.csv"
        path.write_text(write(field_table()))
        return [*board_files(trial), "--control-field", path]

    return Slip(name, kind, trial, "calibrate", right, make)


def _baseline_holds(answer: Answer) -> bool:
    return 420 < float(answer.document.get("geometry", {}).get("baseline_mm", 0.0)) < 424


def _copy(source: Path, target: Path) -> None:
    shutil.copy(source, target)


def _as_tiff(source: Path, target: Path) -> None:
    Image.fromarray(pixels(source)).save(target, "TIFF")


def _with_noise(source: Path, target: Path) -> None:
    image = pixels(source)
    noisy = write_png(
        target.with_suffix(".png"), image + np.random.default_rng(5).normal(0, 1.0, image.shape)
    )
    noisy.rename(target)


def _scaled(factor: float) -> Callable[[Table], str]:
    return lambda table: csv_text(columns_changed(table, ("x_mm", "y_mm", "z_mm"), lambda c: factor * c))


def _heights_in_inches(table: Table) -> str:
    return csv_text(columns_changed(table, ("z_mm",), lambda c: c / 25.4))


def _decimal_commas(table: Table) -> str:
    header, *rows = table
    text = [",".join([*row[:3], row[3].replace(".", ",")]) for row in rows]
    return "\n".join([",".join(header), *text]) + "\n"


def _column_twice(table: Table) -> str:
    header, *rows = table
    return csv_text([[*header, "z_mm"], *([*row, "0.0"] for row in rows)])


def _exchanged(table: Table) -> str:
    header, *rows = table
    return csv_text([header, *([id_, y, x, z] for id_, x, y, z in rows)])


def _downwards(table: Table) -> str:
    return csv_text(columns_changed(table, ("z_mm",), lambda c: -c))


def _one_peg(table: Table) -> str:
    header, *rows = table
    return csv_text([header, *([i, x, y, f"{float(z) + 30:.3f}" if i == "10" else z] for i, x, y, z in rows)])
