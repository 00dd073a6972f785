"""Slips of a person who places centres of balls by hand, asked of a running service."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.slips.service import SlipService, pair_of
from bench.slips.slip import Answer, Right, Slip

_ALL = ("XX", "YY", "MX")


def slips() -> Iterator[Slip]:
    """Yield the slips of centres placed by hand."""
    beside = Right(flags=("centre-displaced",))
    moved = Right(flags=("centre-displaced", "triad-moved-by-edit", "centre-unused", "triad-count-low"))
    for name, balls, shift_px, right in (
        ("three centres of a triad 8 px to the right", _ALL, 8.0, beside),
        ("three centres of a triad 2 px to the left", _ALL, -2.0, beside),
        ("three centres of a triad 30 px to the right", _ALL, 30.0, moved),
        ("one centre 4 px to the right", ("YY",), 4.0, moved),
        ("one centre 20 px to the left", ("XX",), -20.0, moved),
    ):
        yield Slip(name, "edit", "PRE", "service", right, ask=_placed(balls, shift_px))


def _placed(balls: Sequence[str], shift_px: float) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        before = service.stage(surgery, "PRE", pair_of("PRE")).document["triads"][1]
        features = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/features").json()["features"][
            "left"
        ]
        centres = [_move(features, before["balls"][name]["left"], shift_px) for name in balls]
        sent = service.client.post(
            f"/v1/surgeries/{surgery}/stages/PRE/revisions",
            json={"kind": "edit", "take": 1, "centres": centres},
        )
        sent.raise_for_status()
        return service.measured(surgery, "PRE", sent)

    return ask


def _move(features: Sequence[Mapping[str, Any]], xy: Sequence[float], shift_px: float) -> dict[str, Any]:
    u, v = xy
    feature = next(k for k, one in enumerate(features) if [one["x"], one["y"]] == [u, v])
    return {"action": "move", "side": "left", "feature": feature, "x": u + shift_px, "y": v}
