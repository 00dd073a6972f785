"""OpenIGTLink messages of a stage: one TRANSFORM a vertebra, and one TDATA with all of them.

Matrices map a vertebra's own axes (right, anterior, superior; origin at the centroid) to the spine's frame in RAS, mm:
the axes of 3D Slicer, which takes the matrices of both messages as they are. The header is that of protocol 3
(header version 2), with metadata.

A vertebra without a pose is sent as lost, never left out, so that nobody goes on seeing its former place, and so is
every vertebra of a stage without a spine: its
TRANSFORM has the metadata ``Status`` LOST and ``TransformStatus`` MISSING, the key and the word of PLUS and of Slicer's
OpenIGTLinkIF. TDATA has no field for a status; there, and in the TRANSFORM for clients that do not read metadata, all
twelve numbers are NaN, which no client can take for a pose, and the metadata ``Lost`` of TDATA names the vertebrae.
Slicer and VTK do not draw what has such a transform, and draw it again with the next one that has numbers.

References
----------
OpenIGTLink protocol 3, TRANSFORM and TDATA (openigtlink.org); pyigtl has no TDATA.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from pyigtl.messages import MessageBase, TransformMessage

from contract.spine import VertebraState
from contract.summary import SummaryStage
from exports.coordinates import RAS_FROM_PATIENT, transform
from exports.selection import no_spine_reason
from exports.text import ascii_line
from spinewatch.arrays import Float
from spinewatch.errors import ParameterError

NAME_LENGTH = 20
"""Bytes of a device's name, in the header and in TDATA."""

TDATA_NAME = "Spine"
"""Device name of the TDATA message."""

_ELEMENT = struct.Struct("> 20s B B 12f")
_SIX_DEGREES_OF_FREEDOM = 2
_HEADER_VERSION = 2
_LOST = {"Status": "LOST", "TransformStatus": "MISSING"}
_FOUND = {"Status": "OK", "TransformStatus": "OK"}
_NOWHERE = np.vstack([np.full((3, 4), np.nan), [0.0, 0.0, 0.0, 1.0]])


class DeviceNameError(ParameterError):
    """A name that the protocol cannot carry."""

    code = "invalid-device-name"


@dataclass(frozen=True, eq=False)
class TrackedTool:
    """One tool of a TDATA message.

    Attributes
    ----------
    name
        Its name, at most 20 ASCII characters.
    matrix
        Homogeneous matrix, shape (4, 4), mm; NaN for a tool that is lost.
    kind
        Type of the tool: 1 tracker, 2 instrument with six degrees of freedom, 3 with three, 4 with five.
    """

    name: str
    matrix: Float
    kind: int = _SIX_DEGREES_OF_FREEDOM


class TrackingDataMessage(MessageBase):  # type: ignore[misc] # pyigtl has no types
    """TDATA: poses of several tools.

    Parameters
    ----------
    tools
        The tools.
    timestamp
        Time of the poses, s since 1970.
    device_name
        Name of the sender.
    """

    def __init__(
        self,
        tools: Sequence[TrackedTool] = (),
        timestamp: float | None = None,
        device_name: str | None = None,
    ) -> None:
        super().__init__(timestamp=timestamp, device_name=device_name)
        self._message_type = "TDATA"
        self.tools = tuple(tools)
        self._valid_message = True

    def content_asstring(self) -> str:
        """Return the tools, one a line.

        Returns
        -------
        str
            Names with matrices.
        """
        return "\n".join(f"{tool.name}: {tool.matrix.tolist()}" for tool in self.tools)

    def _pack_content(self) -> bytes:
        return b"".join(
            _ELEMENT.pack(device_name(tool.name), tool.kind, 0, *tool.matrix[:3].T.ravel())
            for tool in self.tools
        )

    def _unpack_content(self, content: bytes) -> None:
        self.tools = tuple(_tool(fields) for fields in _ELEMENT.iter_unpack(content))
        self._valid_message = True


def device_name(name: str) -> bytes:
    """Return the bytes of a device's name.

    Parameters
    ----------
    name
        The name.

    Returns
    -------
    bytes
        At most 20 bytes of ASCII.

    Raises
    ------
    DeviceNameError
        If it is empty, longer, or not printable ASCII.

    Examples
    --------
    >>> device_name("T9ToSpine")
    b'T9ToSpine'
    """
    if not name.isascii() or not name.isprintable() or not 0 < len(name) <= NAME_LENGTH:
        raise DeviceNameError(
            f"the device name {name!r} must have 1 to {NAME_LENGTH} printable ASCII characters; shorten it"
        )
    return name.encode("ascii")


def stage_messages(stage: SummaryStage, surgery_id: str, former: Iterable[str] = ()) -> list[MessageBase]:
    """Return the messages of a stage.

    Parameters
    ----------
    stage
        The stage.
    surgery_id
        Identifier of its surgery.
    former
        Vertebrae that were sent before, or that other stages have; those that are not among the stage's are sent as
        lost. A stage without a spine has none of them.

    Returns
    -------
    list of MessageBase
        A TRANSFORM for each vertebra, cranial first, named such as ``T9ToSpine``, and the TDATA message ``Spine``; none
        where there is no vertebra to tell of.
    """
    time = (stage.captured_at or stage.created_at).timestamp()
    common = _common(stage, surgery_id)
    states = [] if stage.spine is None else stage.spine.vertebrae
    statuses = {state.vertebra: _status(state) for state in states}
    matrices = {state.vertebra: _matrix(state) for state in states}
    gone = "it is not in the spine any more" if stage.spine is not None else no_spine_reason(stage)
    for level in former:
        statuses.setdefault(level, _LOST | {"Vertebra": level, "Reason": ascii_line(gone)})
        matrices.setdefault(level, _NOWHERE)
    if not statuses:
        return []
    tools = {level: TrackedTool(f"{level}ToSpine", matrix) for level, matrix in matrices.items()}
    messages: list[MessageBase] = []
    for level, tool in tools.items():
        message = TransformMessage(tool.matrix, timestamp=time, device_name=device_name(tool.name).decode())
        message.metadata = {**statuses[level], **common}
        messages.append(message)
    tracking = TrackingDataMessage(tuple(tools.values()), timestamp=time, device_name=TDATA_NAME)
    lost = [level for level, status in statuses.items() if status["Status"] == _LOST["Status"]]
    tracking.metadata = {"Lost": " ".join(lost), **common}
    messages.append(tracking)
    for message in messages:
        message.header_version = _HEADER_VERSION
    return messages


def _tool(fields: tuple[bytes | int | float, ...]) -> TrackedTool:
    name, kind, _, *numbers = fields
    matrix = np.eye(4)
    matrix[:3] = np.array(numbers, dtype=np.float64).reshape(4, 3).T
    return TrackedTool(bytes(name).rstrip(b" \0").decode("ascii", "replace"), matrix, int(kind))  # type: ignore[arg-type]


def _lost(state: VertebraState) -> bool:
    return state.position_mm is None or state.rotation is None


def _matrix(state: VertebraState) -> Float:
    if _lost(state):
        return _NOWHERE
    return transform(RAS_FROM_PATIENT, np.array(state.rotation), np.array(state.position_mm))


def _status(state: VertebraState) -> dict[str, str]:
    return {
        **(_LOST if _lost(state) else _FOUND),
        "Vertebra": state.vertebra,
        "Origin": state.origin.value,
        "Marked": "true" if state.marked else "false",
        "Reason": ascii_line(state.reason or state.position_reason or ""),
        "PositionSdAnteriorLeftCephaladMm": _numbers(state.position_sd_mm),
        "RotationSdOwnXYZDeg": _numbers(state.rotation_sd_deg),
    }


def _common(stage: SummaryStage, surgery_id: str) -> dict[str, str]:
    spine = stage.spine
    of_stage = {
        "SurgeryId": ascii_line(surgery_id),
        "Stage": stage.name,
        "Take": str(stage.take),
        "CapturedAt": "" if stage.captured_at is None else stage.captured_at.isoformat(),
    }
    if spine is None:
        return {**of_stage, "NoSpine": ascii_line(no_spine_reason(stage))}
    return {
        **of_stage,
        "Frame": ascii_line(spine.frame),
        "CoordinateSystem": "RAS, mm",
        "Baseline": spine.baseline.name,
        "Initial": spine.initial.value,
        "Version": ascii_line(spine.version),
    }


def _numbers(values: Sequence[float] | None) -> str:
    return "" if values is None else " ".join(f"{value:.4g}" for value in values)
