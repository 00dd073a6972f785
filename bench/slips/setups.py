"""Slips in the setup of a spine, asked of a running service: units, signs and missing deviations of initial poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.slips.service import SlipService, pair_of
from bench.slips.slip import Answer, Right, Slip

_CURVE = {
    "T7": (0.0, 150.0, 20.0),
    "T9": (12.5, 100.0, 8.0),
    "T11": (12.5, 50.0, -8.0),
    "L1": (0.0, 0.0, -20.0),
}
"""Position to the left and upwards, mm, and coronal tilt, degrees."""


def slips() -> Iterator[Slip]:
    """Yield the slips in the setup of a spine."""
    doubtful = ("initial-tilts-doubtful",)
    radians = Right(refusal=r"radians", flags=doubtful)
    yield _slip("angles of initial poses in radians", radians, _poses(angle=np.pi / 180))
    yield _slip(
        "coronal tilts of initial poses with the opposite sign", Right(flags=doubtful), _poses(angle=-1.0)
    )
    two = _poses(("T11", "L1"), length=0.1)
    yield _slip("positions of two initial poses in centimetres", Right(refusal=r"in mm"), two)
    yield _slip("initial poses without deviations", Right(sound=_has_deviations), _poses())


def _slip(name: str, right: Right, poses: Sequence[dict[str, Any]]) -> Slip:
    return Slip(name, "setup", "PRE", "service", right, ask=_asked(poses))


def _poses(
    levels: Sequence[str] = tuple(_CURVE), *, angle: float = 1.0, length: float = 1.0
) -> list[dict[str, Any]]:
    return [
        {
            "vertebra": name,
            "position_mm": [0.0, length * left, length * up],
            "angles_deg": [angle * tilt, 0.0, 0.0],
        }
        for name, (left, up, tilt) in _CURVE.items()
        if name in levels
    ]


def _asked(poses: Sequence[dict[str, Any]]) -> Callable[[SlipService, Path], Answer]:
    setup = {
        "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
        "levels": [pose["vertebra"] for pose in poses],
        "initial": {"kind": "poses", "frame": "patient", "poses": list(poses)},
    }

    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        service.stage(surgery, "PRE", pair_of("PRE"))
        return service.spine(surgery, "PRE", setup)

    return ask


def _has_deviations(answer: Answer) -> bool:
    measured = [measure for measure in answer.document["measures"] if measure["value"] is not None]
    return bool(measured) and all(measure["sd"] is None or measure["sd"] > 0 for measure in measured)
