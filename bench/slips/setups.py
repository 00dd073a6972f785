"""Slips in the setup of a spine, asked of a running service: units, signs and missing deviations of initial poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.slips.service import SlipService, pair_of
from bench.slips.slip import Answer, Right, Slip
from spinewatch.levels import anatomical_sequence

_CURVE = {
    "T7": (0.0, 150.0, 20.0),
    "T9": (12.5, 100.0, 8.0),
    "T11": (12.5, 50.0, -8.0),
    "L1": (0.0, 0.0, -20.0),
}
"""Position to the left and upwards, mm, and coronal tilt, degrees."""

_SAMPLE = {
    "T7": (-27.0, 151.0, 11.0, -16.0),
    "T9": (-18.0, 105.0, 12.0, -13.0),
    "T11": (-6.0, 49.0, 9.0, 1.0),
    "L1": (0.0, 0.0, 5.0, 17.0),
}
"""Poses that the sample's triads of PRE fit: the same, and the axial rotation, degrees."""
_SEQUENCE = anatomical_sequence(())
_HOLDER_MM = 45.0
"""Height of a triad over the centroid of its vertebra, mm."""


def slips() -> Iterator[Slip]:
    """Yield the slips in the setup of a spine."""
    doubtful = ("initial-tilts-doubtful",)
    radians = Right(refusal=r"radians", flags=doubtful)
    yield _slip("angles of initial poses in radians", radians, _poses(angle=np.pi / 180))
    yield _slip(
        "coronal tilts of initial poses with the opposite sign", Right(flags=doubtful), _poses(angle=-1.0)
    )
    zeros = _poses(angle=0.0, sagittal=4.0)
    yield _slip("coronal tilts of initial poses left at 0", Right(flags=doubtful), zeros)
    yield _slip("initial poses of the sample", Right(sound=_unflagged), _sample_poses())
    yield _slip(
        "initial poses of a film that was read from the other side",
        Right(flags=("initial-poses-reversed",)),
        _sample_poses(left=-1.0),
    )
    two = _poses(("T11", "L1"), length=0.1)
    yield _slip("positions of two initial poses in centimetres", Right(refusal=r"in mm"), two)
    yield _slip("initial poses without deviations", Right(sound=_has_deviations), _poses())
    for name, shift in (("cranial", -1), ("caudal", 1)):
        right = Right(flags=("initial-levels-shifted",))
        title = f"vertebrae of initial poses in object axes named a level too {name}"
        yield Slip(title, "setup", "PRE", "service", right, ask=_named(shift))
    yield Slip(
        "initial poses in object axes", "setup", "PRE", "service", Right(sound=_unshifted), ask=_named(0)
    )
    yield Slip(
        "a marker stored as clamped again, before and after a correction",
        "setup",
        "POST",
        "service",
        Right(flags=("rebaseline-moved",)),
        ask=_clamped_again,
    )


def _slip(name: str, right: Right, poses: Sequence[dict[str, Any]]) -> Slip:
    return Slip(name, "setup", "PRE", "service", right, ask=_asked(poses))


def _poses(
    levels: Sequence[str] = tuple(_CURVE), *, angle: float = 1.0, length: float = 1.0, sagittal: float = 0.0
) -> list[dict[str, Any]]:
    return [
        {
            "vertebra": name,
            "position_mm": [0.0, length * left, length * up],
            "angles_deg": [angle * tilt, sagittal, 0.0],
        }
        for name, (left, up, tilt) in _CURVE.items()
        if name in levels
    ]


def _sample_poses(left: float = 1.0) -> list[dict[str, Any]]:
    return [
        {
            "vertebra": name,
            "position_mm": [0.0, left * aside, up],
            "angles_deg": [left * coronal, -4.0, left * axial],
        }
        for name, (aside, up, coronal, axial) in _SAMPLE.items()
    ]


def _asked(poses: Sequence[dict[str, Any]]) -> Callable[[SlipService, Path], Answer]:
    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        service.stage(surgery, "PRE", pair_of("PRE"))
        return service.spine(surgery, "PRE", _setup(poses))

    return ask


def _setup(poses: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {
        "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
        "levels": [pose["vertebra"] for pose in poses],
        "initial": {"kind": "poses", "frame": "patient", "poses": list(poses)},
    }


def _clamped_again(service: SlipService, _: Path) -> Answer:
    surgery, setup = service.surgery(), _setup(_sample_poses())
    for stage in ("PRE", "POST"):
        service.stage(surgery, stage, pair_of(stage))
    service.spine(surgery, "PRE", setup)
    again = {"vertebra": "T9", "before": "PRE", "after": "POST"}
    service.client.post(f"/v1/surgeries/{surgery}/spine/rebaselines", json=again).raise_for_status()
    return service.spine(surgery, "POST", setup)


def _unflagged(answer: Answer) -> bool:
    return not answer.codes and bool(answer.document["measures"])


def _named(shift: int) -> Callable[[SlipService, Path], Answer]:
    """Return poses of T6 to L2 below the triads of a stage, named ``shift`` levels off."""

    def ask(service: SlipService, _: Path) -> Answer:
        surgery = service.surgery()
        triads = service.stage(surgery, "PRE", pair_of("PRE")).document["triads"]
        marked = [_SEQUENCE.index(triad["label"]) for triad in triads]
        order = np.argsort(marked)
        places = np.array([triad["position_mm"] for triad in triads])[order] - [0.0, 0.0, _HOLDER_MM]
        numbers = np.arange(_SEQUENCE.index("T6"), _SEQUENCE.index("L2") + 1)
        fit = np.polyfit(np.array(marked)[order], places, 2)
        poses = [
            {
                "vertebra": _SEQUENCE[number + shift],
                "position_mm": (fit[0] * number**2 + fit[1] * number + fit[2]).tolist(),
                "angles_deg": [0.0, 0.0, 0.0],
            }
            for number in numbers
        ]
        setup = {
            "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
            "initial": {"kind": "poses", "frame": "object", "poses": poses},
        }
        return service.spine(surgery, "PRE", setup)

    return ask


def _unshifted(answer: Answer) -> bool:
    return "initial-levels-shifted" not in answer.codes and _has_deviations(answer)


def _has_deviations(answer: Answer) -> bool:
    measured = [measure for measure in answer.document["measures"] if measure["value"] is not None]
    return bool(measured) and all(measure["sd"] is None or measure["sd"] > 0 for measure in measured)
