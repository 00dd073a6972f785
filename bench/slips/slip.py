"""A slip, the answer of a command to it, and the verdict on that answer."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from bench.slips.service import SlipService

Kind = Literal[
    "labels",
    "marker",
    "edit",
    "order",
    "setup",
    "rig",
    "swap",
    "unit",
    "time",
    "table",
    "camera file",
    "image",
    "exposure",
    "stale",
    "calibration",
    "system",
    "sound",
]
Verdict = Literal["refused", "flagged", "read", "silent", "wrong", "crash"]

ROUTINE_FLAGS = frozenset({"parameters-held"})
"""Flags that sound input raises too; they are no answer to a slip."""


@dataclass(frozen=True)
class Answer:
    """What a command, or the service, gave back.

    Attributes
    ----------
    status
        0 for a result, 2 for a refusal, anything else as the process ended; None for a traceback.
    message
        Everything on stderr; for ``convert`` what it printed, too; for the service the problem's detail.
    document
        The JSON result; empty without one.
    seconds
        Processor time of a command; wall time of the service.
    """

    status: int | None
    message: str = ""
    document: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def flags(self) -> tuple[tuple[str, str], ...]:
        """Code and detail of each flag."""
        return tuple((flag["code"], flag["detail"]) for flag in self.document.get("flags", ()))

    @property
    def codes(self) -> frozenset[str]:
        """Codes of the flags."""
        return frozenset(code for code, _ in self.flags)

    @property
    def labels(self) -> tuple[str | None, ...]:
        """Labels of the triads."""
        return tuple(triad["label"] for triad in self.document.get("triads", ()))


@dataclass(frozen=True)
class Right:
    """What counts as the right answer; any one of the alternatives that are given.

    Attributes
    ----------
    refusal
        Pattern in the sentence of a refusal; empty: a refusal is not right.
    flags
        Codes, one of which the result must carry.
    detail
        Pattern in the detail of that flag.
    labels_null
        Whether a flagged result must leave every label null.
    warning
        Pattern in what a command without a JSON result prints.
    sound
        Whether a result without such a flag is right all the same.
    """

    refusal: str = ""
    flags: tuple[str, ...] = ()
    detail: str = ""
    labels_null: bool = False
    warning: str = ""
    sound: Callable[[Answer], bool] | None = None

    def verdict(self, answer: Answer) -> Verdict:
        """Return the verdict on an answer."""
        if answer.status not in (0, 2):
            return "crash"
        if answer.status == 2:
            return "refused" if self.refusal and _matches(self.refusal, answer.message) else "wrong"
        if self._flagged(answer) or (self.warning and _matches(self.warning, answer.message)):
            return "flagged"
        if self.sound is not None and self.sound(answer):
            return "read"
        return "wrong" if answer.codes - ROUTINE_FLAGS else "silent"

    def _flagged(self, answer: Answer) -> bool:
        named = any(code in self.flags and _matches(self.detail, detail) for code, detail in answer.flags)
        return named and not (self.labels_null and any(answer.labels))


@dataclass(frozen=True)
class Slip:
    """One slip.

    Attributes
    ----------
    name
        Unique, in words.
    kind
        The group it belongs to.
    pair
        The sound input that it is made from.
    command
        ``process``, ``calibrate``, ``convert``, ``db`` or ``service``.
    right
        What counts as the right answer.
    make
        Writes files into a folder and returns the arguments of the command.
    ask
        Asks a running service instead.
    """

    name: str
    kind: Kind
    pair: str
    command: str
    right: Right
    make: Callable[[Path], Sequence[object]] | None = None
    ask: Callable[[SlipService, Path], Answer] | None = None


@dataclass(frozen=True)
class Outcome:
    """A slip with the answer to it."""

    slip: Slip
    answer: Answer

    @property
    def verdict(self) -> Verdict:
        """The verdict on the answer."""
        return self.slip.right.verdict(self.answer)

    @property
    def figures(self) -> str:
        """What the answer says, in a few words."""
        if self.answer.status is None:
            return self.answer.message.strip().splitlines()[-1][:120] if self.answer.message else "traceback"
        if self.answer.status != 0:
            return self.answer.message.strip().replace("\n", " / ")[:160]
        return _figures(self.answer)


def _matches(pattern: str, text: str) -> bool:
    return re.search(pattern, text, re.IGNORECASE) is not None


def _figures(answer: Answer) -> str:
    document, parts = answer.document, []
    if "triads" in document:
        names = ",".join(str(label or "-") for label in answer.labels)
        parts.append(f"{len(document['triads'])} triads {names}".strip())
    if "vertebrae" in document:
        motions = [f"{v['vertebra']} {v.get('distance_mm', 0.0):.2f} mm" for v in document["vertebrae"]]
        parts.append("motion " + ", ".join(motions))
    geometry = document.get("geometry")
    if geometry:
        deviation = geometry.get("baseline_sd_mm")
        parts.append(f"baseline {geometry['baseline_mm']:.4g} +- {deviation or float('nan'):.2g} mm")
        rms = [camera["image_rms_px"] for camera in document.get("cameras", {}).values()]
        parts.append("rms " + "/".join(f"{value:.2g}" for value in rms) + " px")
    if "off_mm" in document:
        parts.append(f"off {document['off_mm']:.2f} mm, {document['off_sd']:.1f} sd")
    if not document:
        parts.append(answer.message.strip().replace("\n", " / ")[:160])
    parts.append(" ".join(sorted(answer.codes)) or "no flag")
    return "; ".join(parts)


def to_json(outcomes: Sequence[Outcome]) -> str:
    """Return the outcomes as JSON text."""
    rows = [
        {
            "name": outcome.slip.name,
            "kind": outcome.slip.kind,
            "pair": outcome.slip.pair,
            "command": outcome.slip.command,
            "verdict": outcome.verdict,
            "figures": outcome.figures,
            "seconds": round(outcome.answer.seconds, 2),
            "message": outcome.answer.message[-2000:],
            "flags": [f"{code}: {detail}" for code, detail in outcome.answer.flags],
        }
        for outcome in outcomes
    ]
    return json.dumps(rows, indent=1) + "\n"
