"""Slips of point tables: ``calibrate`` with CSV files of image points that are written or meant otherwise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from bench.slips.slip import Answer, Kind, Right, Slip
from bench.slips.sound import Table, changed_rig, columns_changed, csv_text, each_camera, point_tables, rig

Write = Callable[[Table], bytes]
Change = Callable[[Table], Table]

_MM = ("x_mm", "y_mm", "z_mm")
_PX = ("u_px", "v_px")
_CART = ("--image-size", "568x416")
_BASELINE_MM = (421.0, 423.0)


def slips() -> Iterator[Slip]:
    """Yield the slips of point tables."""
    yield from _spelling()
    yield from _numbers()
    yield from _sizes()


def baseline_holds(answer: Answer) -> bool:
    """Return whether the baseline is that of the rig that the tables were made with."""
    low, high = _BASELINE_MM
    return low < float(answer.document.get("geometry", {}).get("baseline_mm", 0.0)) < high


def _spelling() -> Iterator[Slip]:
    line = r"line \d+"
    fields = Right(refusal=rf"{line}.*(fields|columns|comma)|(fields|columns|comma).*{line}")
    yield _table("decimal commas in every number", _text(_decimal_commas), fields)
    yield _table("decimal commas in z alone", _text(lambda t: _decimal_commas(t, {3})), fields)
    yield _table(
        "decimal commas in quotes",
        lambda t: csv_text(_with_commas(t)).encode(),
        Right(refusal=line, sound=baseline_holds),
    )
    twice = Right(refusal=r"u_px.*twice|twice.*u_px")
    yield _table(
        "a column twice",
        _table_of(lambda t: [[*row, cell] for row, cell in zip(t, _scaled_u(t), strict=True)]),
        twice,
    )
    shifted = Right(refusal=rf"{line}.*(fields|columns)|(fields|columns).*{line}")
    yield _table("one row with a field too many", _table_of(_field_too_many), shifted)
    yield _table(
        "one row with a field too few", _table_of(lambda t: [*t[:4], t[4][:-1], *t[5:]]), Right(refusal=line)
    )
    accepted = Right(sound=baseline_holds)
    yield _table("a byte-order mark", lambda t: b"\xef\xbb\xbf" + csv_text(t).encode(), accepted)
    yield _table("line ends of Windows", lambda t: csv_text(t).replace("\n", "\r\n").encode(), accepted)
    yield _table("semicolons between fields", lambda t: csv_text(t, ";").encode(), accepted)
    either = Right(refusal=r"semicolon|comma|separat|tab", sound=baseline_holds)
    yield _table("semicolons and decimal commas", lambda t: csv_text(_with_commas(t), ";").encode(), either)
    yield _table("tabs between fields", lambda t: csv_text(t, "\t").encode(), either)
    yield _table(
        "UTF-16, as a spreadsheet's Unicode text",
        lambda t: csv_text(t).encode("utf-16"),
        Right(refusal=r"text file|UTF-8"),
    )
    yield _table(
        "a number of 400 digits", _table_of(lambda t: _cell(t, 3, "u_px", "9" * 400)), Right(refusal=line)
    )
    yield _table("an id twice", _table_of(lambda t: [*t, t[1]]), Right(refusal=r"twice"))


def _numbers() -> Iterator[Slip]:
    unit = Right(refusal=r"metre|unit|baseline|_mm")
    for name, factor in (("metres", 0.001), ("centimetres", 0.1), ("inches", 1 / 25.4)):
        yield _points(f"control points in {name}", "unit", _scaled(factor), unit)
    normalized = Right(refusal=r"normalized|one pixel|0\.\.1")
    yield _points("image points from 0 to 1", "unit", _normalized, normalized)
    outside = Right(refusal=r"outside|image size|larger than")
    yield _points(
        "image points of twice the image's size",
        "table",
        lambda t: columns_changed(t, _PX, lambda c: 2 * c),
        outside,
    )
    yield _points(
        "image points of half the image's size",
        "table",
        lambda t: columns_changed(t, _PX, lambda c: c / 2),
        Right(refusal=r"image size|half|pixel|principal", flags=("pixel-size-doubtful", "calibration-poor")),
    )
    wrong = Right(refusal=r"mirror|exchange|swap|fit|columns", flags=("calibration-poor",))
    yield _points("u and v exchanged", "order", _columns_exchanged("u_px", "v_px"), wrong)
    yield _points("x and y exchanged", "order", _columns_exchanged("x_mm", "y_mm"), wrong)
    yield _points(
        "v counted from below", "table", lambda t: columns_changed(t, ("v_px",), lambda c: 415 - c), wrong
    )
    yield _points(
        "heights counted downwards",
        "table",
        lambda t: columns_changed(t, ("z_mm",), lambda c: -c),
        Right(refusal=r"upside|Z|mirror"),
    )
    blunder = Right(
        refusal=r"contradict|exchange|fit|do not see|named correctly",
        flags=("control-point-removed", "calibration-poor"),
    )
    yield _one_side("two points exchanged in one camera", _two_ids_exchanged, blunder)
    yield _one_side(
        "one height mistyped in one of the tables",
        lambda t: _cell(t, 3, "z_mm", "98.979"),
        Right(refusal=r"differ|two places|both|contradict|coordinates"),
    )
    yield Slip(
        "left and right tables exchanged",
        "swap",
        "simulated table",
        "calibrate",
        Right(refusal=r"exchange|swap"),
        _exchanged,
    )
    yield Slip(
        "the left table twice", "swap", "simulated table", "calibrate", Right(refusal=r"same|twice"), _twice
    )


def _sizes() -> Iterator[Slip]:
    vga = changed_rig(each_camera("image_size_px", lambda _: [640, 480]))
    each_camera("pixel_size_mm", lambda _: [0.01, 0.01])(vga)
    doubtful = Right(refusal=r"pixel.?size", flags=("pixel-size-doubtful",))
    plain = point_tables(vga, seed=21)

    def make(folder: Path) -> Sequence[object]:
        return [*_written(folder, plain), "--image-size", "640x480"]

    yield Slip("640x480 without a pixel size", "unit", "simulated table", "calibrate", doubtful, make)
    for name, value in (
        ("in micrometres", "10,8.45"),
        ("in metres", "0.00001,0.00000845"),
        ("exchanged", "0.00845,0.01"),
        ("of a square pixel", "0.01,0.01"),
    ):
        right = Right(
            refusal=r"pixel.?size|micrometre|misses the control points", flags=("pixel-size-doubtful",)
        )
        yield _options(f"pixel size {name}", "unit", (*_CART, "--pixel-size", value), right)
    held = Right(flags=("held-value-contradicted",))
    for value in ("f=8", "f=7.7", "K1=0"):
        yield _options(f"--fix {value}, a nominal value", "calibration", (*_CART, "--fix", value), held)
    size = Right(refusal=r"outside|image.?size|principal", flags=("pixel-size-doubtful",))
    yield _options("image size with height first", "table", ("--image-size", "416x568"), size)
    yield _options("image size of another camera", "table", ("--image-size", "1136x832"), size)


def _table(name: str, write: Write, right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        return [*_written(folder, point_tables(rig()), write), *_CART]

    return Slip(name, "table", "simulated table", "calibrate", right, make)


def _points(name: str, kind: Kind, change: Change, right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        left, right_table = point_tables(rig())
        return [*_written(folder, (change(left), change(right_table))), *_CART]

    return Slip(name, kind, "simulated table", "calibrate", right, make)


def _one_side(name: str, change: Change, right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        left, right_table = point_tables(rig())
        return [*_written(folder, (left, change(right_table))), *_CART]

    return Slip(name, "table", "simulated table", "calibrate", right, make)


def _options(name: str, kind: Kind, options: Sequence[str], right: Right) -> Slip:
    def make(folder: Path) -> Sequence[object]:
        return [*_written(folder, point_tables(rig())), *options]

    return Slip(name, kind, "simulated table", "calibrate", right, make)


def _exchanged(folder: Path) -> Sequence[object]:
    left, right = _written(folder, point_tables(rig()))
    return [right, left, *_CART]


def _twice(folder: Path) -> Sequence[object]:
    left, _ = _written(folder, point_tables(rig()))
    return [left, left, *_CART]


def _utf8(table: Table) -> bytes:
    return csv_text(table).encode()


def _text(write: Callable[[Table], str]) -> Write:
    return lambda table: write(table).encode()


def _table_of(change: Change) -> Write:
    return lambda table: _utf8(change(table))


def _written(folder: Path, tables: Sequence[Table], write: Write = _utf8) -> list[Path]:
    paths = [folder / "left.csv", folder / "right.csv"]
    for path, table in zip(paths, tables, strict=True):
        path.write_bytes(write(table))
    return paths


def _with_commas(table: Table) -> Table:
    return [table[0], *([row[0], *(cell.replace(".", ",") for cell in row[1:])] for row in table[1:])]


def _decimal_commas(table: Table, columns: set[int] | None = None) -> str:
    """Return the text of a table whose numbers carry decimal commas, without quotes."""
    rows = [
        [cell.replace(".", ",") if columns is None or i in columns else cell for i, cell in enumerate(row)]
        for row in table
    ]
    return "\n".join(",".join(row) for row in rows) + "\n"


def _scaled_u(table: Table) -> list[str]:
    place = table[0].index("u_px")
    return ["u_px", *(f"{1.02 * float(row[place]):.3f}" for row in table[1:])]


def _field_too_many(table: Table) -> Table:
    return [*table[:3], [*table[3][:3], "0", *table[3][3:]], *table[4:]]


def _cell(table: Table, line: int, column: str, value: str) -> Table:
    changed = [list(row) for row in table]
    changed[line][table[0].index(column)] = value
    return changed


def _two_ids_exchanged(table: Table) -> Table:
    a, b = table[2], table[7]
    return [*table[:2], [*a[:4], *b[4:]], *table[3:7], [*b[:4], *a[4:]], *table[8:]]


def _columns_exchanged(a: str, b: str) -> Change:
    def change(table: Table) -> Table:
        i, j = table[0].index(a), table[0].index(b)
        rows = [list(row) for row in table]
        for row in rows[1:]:
            row[i], row[j] = row[j], row[i]
        return rows

    return change


def _scaled(factor: float) -> Change:
    return lambda table: columns_changed(table, _MM, lambda c: factor * c)


def _normalized(table: Table) -> Table:
    return columns_changed(columns_changed(table, ("u_px",), lambda c: c / 568), ("v_px",), lambda c: c / 416)
