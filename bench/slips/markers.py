"""Slips in the description of markers: ``process`` of a sample stage, and the service."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import perf_counter

from bench.slips.service import SlipService, answer_of, pair_of
from bench.slips.slip import Answer, Right, Slip
from bench.slips.sound import process_arguments, stage_files

_OTHER = Right(flags=("marker-doubtful",), detail=r"fit the marker flat(:18,14,10|-10-14-18)")
_MM = Right(refusal=r"\bmm\b")

_CASES: tuple[tuple[str, str, tuple[str, ...], Right], ...] = (
    ("legs in the order of the marker's name", "PRE", ("flat:10,14,18",), _OTHER),
    ("two legs exchanged", "INTER", ("flat:14,18,10",), _OTHER),
    ("the other two legs exchanged", "POST", ("flat:18,10,14",), _OTHER),
    ("legs doubled", "PRE", ("flat:36,28,20",), _OTHER),
    ("legs halved", "INTER", ("flat:9,7,5",), _OTHER),
    ("legs in tenths of a millimetre", "POST", ("flat:180,140,100",), _OTHER),
    ("legs in centimetres", "PRE", ("flat:1.8,1.4,1.0",), _MM),
    ("legs in metres", "INTER", ("flat:0.018,0.014,0.010",), _MM),
    ("a flat marker described as orthogonal", "POST", ("orthogonal:18,14,10",), _OTHER),
    ("legs of balls that overlap", "PRE", ("flat:9,4,6",), Right(refusal=r"overlap")),
    (
        "two markers that look the same",
        "INTER",
        ("orthogonal:30,22,16", "orthogonal:22,16,30"),
        Right(refusal=r"told apart"),
    ),
)


def slips() -> Iterator[Slip]:
    """Yield the slips in the description of markers."""
    for name, stage, texts, right in _CASES:
        yield Slip(
            f"{name}: {' and '.join(texts)}", "marker", stage, "process", right, _process(stage, texts)
        )
    for name, texts, right in (
        ("legs in the order of the marker's name, sent with the images", ("flat:10,14,18",), _OTHER),
        ("legs of balls that overlap, sent with the images", ("flat:9,4,6",), Right(refusal=r"overlap")),
    ):
        yield Slip(name, "marker", "PRE", "service", right, ask=_sent(texts))


def _process(stage: str, texts: Sequence[str]) -> Callable[[Path], Sequence[object]]:
    markers = [part for text in texts for part in ("--marker", text)]
    return lambda _: [*process_arguments(stage_files(stage)), *markers]


def _sent(texts: Sequence[str]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        start, surgery = perf_counter(), service.surgery()
        left, right = pair_of("PRE")
        sent = service.client.post(
            f"/v1/surgeries/{surgery}/stages",
            data={"name": "PRE", "calibration_id": service.calibration, "marker": list(texts)},
            files={"left": ("left.png", left), "right": ("right.png", right)},
        )
        return service.measured(surgery, "PRE", sent) if sent.is_success else answer_of(sent, start)

    return ask
