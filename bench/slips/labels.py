"""Slips of names and order: ``process`` of a sample stage with other labels than the triads in view have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from bench.slips.run import run_command
from bench.slips.slip import Kind, Right, Slip
from bench.slips.sound import process_arguments, stage_files

_TOO_MANY = Right(flags=("triad-count-high",), labels_null=True)
_LEVELS = Right(
    refusal=r"order|sequence|spacing|level",
    flags=("levels-implausible", "labels-uncertain"),
    labels_null=True,
)
_SEQUENCE = Right(refusal=r"order|sequence|monoton")
_TWICE = Right(refusal=r"twice|same vertebra")


def _unknown(name: str) -> Right:
    return Right(refusal=rf"\b{name}\b.*(vertebra|anatom|C1)")


_CASES: tuple[tuple[str, Kind, str, str, Right], ...] = (
    ("two names of four triads", "labels", "PRE", "L1,T9", _TOO_MANY),
    ("three names of four triads, the last forgotten", "labels", "INTER", "L1,T11,T9", _TOO_MANY),
    ("three names of four triads, the first forgotten", "labels", "POST", "T11,T9,T7", _TOO_MANY),
    ("three names of four triads, one between forgotten", "labels", "POST", "L1,T11,T7", _TOO_MANY),
    ("one name of four triads", "labels", "INTER", "T9", _TOO_MANY),
    ("neighbours exchanged", "order", "PRE", "L1,T9,T11,T7", _SEQUENCE),
    ("names shuffled", "order", "POST", "T9,L1,T7,T11", _SEQUENCE),
    ("L9", "labels", "INTER", "L1,L9,T9,T7", _unknown("L9")),
    ("T77", "labels", "PRE", "L1,T11,T9,T77", _unknown("T77")),
    ("C0", "labels", "POST", "L1,T11,T9,C0", _unknown("C0")),
    ("S4", "labels", "POST", "S4,L1,T11,T9", _unknown("S4")),
    ("letter and number exchanged", "labels", "PRE", "1L,T11,T9,T7", _unknown("1L")),
    ("a name that is no vertebra", "labels", "INTER", "L1,T11,rib,T7", _unknown("rib")),
    ("one vertebra in two spellings", "labels", "PRE", "L1,l1,T11,T9", _TWICE),
    ("one vertebra with a leading zero", "labels", "POST", "T9,T09,T7,T5", _TWICE),
    ("every level named, every other one marked", "labels", "PRE", "L1,T12,T11,T10", _LEVELS),
    ("half of the spine named", "labels", "INTER", "L5,L1,T9,T1", _LEVELS),
    ("one name wrong by a level", "labels", "POST", "L1,T11,T10,T7", _LEVELS),
    ("one name wrong by three levels", "labels", "PRE", "L4,T11,T9,T7", _LEVELS),
)


def slips() -> Iterator[Slip]:
    """Yield the slips of names and order."""
    for name, kind, stage, labels, right in _CASES:
        yield _slip(f"{name}: {labels}", kind, stage, labels, right)
    contradicted = Right(flags=("levels-implausible",), detail=r"earlier stage", labels_null=True)
    for name, labels in (
        ("all names in reverse order, with the stage before", "T7,T9,T11,L1"),
        ("all names shifted by one level, with the stage before", "L2,T12,T10,T8"),
    ):
        yield Slip(f"{name}: {labels}", "labels", "INTER", "process", contradicted, _after_pre(labels))
    yield _slip("number of triads too small", "labels", "PRE", None, _TOO_MANY, "--triads", 3)
    yield _slip(
        "number of triads too large",
        "labels",
        "INTER",
        None,
        Right(flags=("triad-count-low",)),
        "--triads",
        5,
    )
    across = Right(
        refusal=r"axis",
        flags=("levels-implausible", "labels-uncertain", "spine-axis-implausible"),
        labels_null=True,
    )
    yield Slip(
        "the other spine axis",
        "order",
        "PRE",
        "process",
        across,
        lambda _: process_arguments(stage_files("PRE"), axis="y"),
    )


def _after_pre(labels: str) -> Callable[[Path], Sequence[object]]:
    def make(folder: Path) -> Sequence[object]:
        earlier = folder / "PRE.json"
        run_command("process", [*process_arguments(stage_files("PRE")), "--out", earlier])
        return [*process_arguments(stage_files("INTER"), labels=labels), "--earlier", earlier]

    return make


def _slip(name: str, kind: Kind, stage: str, labels: str | None, right: Right, *more: object) -> Slip:
    def make(_: Path) -> Sequence[object]:
        return [*process_arguments(stage_files(stage), labels=labels), *more]

    return Slip(name, kind, stage, "process", right, make)
