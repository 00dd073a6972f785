"""OpenIGTLink: TDATA byte by byte, the checksum, and lost vertebrae that are sent as lost."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from pyigtl.messages import CRC64, MessageBase, TransformMessage

from contract.summary import SurgerySummary
from exports.coordinates import RAS_FROM_PATIENT, transform
from exports.openigtlink import (
    DeviceNameError,
    TrackedTool,
    TrackingDataMessage,
    device_name,
    stage_messages,
)
from tests.contract.spine_results import SURGERY, pose
from tests.exports.hostile import TEXTS, many_stages, with_text

HEADER_BYTES = 58
ELEMENT_BYTES = 70


def crc64(content: bytes) -> int:
    """ECMA-182, bit by bit."""
    crc = 0
    for byte in content:
        crc ^= byte << 56
        for _ in range(8):
            crc = ((crc << 1) ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)) & 0xFFFFFFFFFFFFFFFF
    return crc


def received(content: bytes) -> MessageBase:
    fields = MessageBase.parse_header(content[:HEADER_BYTES])
    message: MessageBase
    message = TrackingDataMessage() if fields["message_type"] == "TDATA" else TransformMessage()
    message.unpack(fields, content[HEADER_BYTES:])
    return message


def test_tdata_byte_by_byte() -> None:
    matrix = np.eye(4)
    matrix[:3] = [[1, 4, 7, 10], [2, 5, 8, 11], [3, 6, 9, 12]]
    message = TrackingDataMessage([TrackedTool("T9", matrix)], timestamp=1.5, device_name="Spine")
    body = b"T9" + bytes(18) + bytes([2, 0]) + struct.pack(">12f", *range(1, 13))
    header = (
        struct.pack(">H", 1) + b"TDATA".ljust(12, b"\0") + b"Spine".ljust(20, b"\0")
        + struct.pack(">II", 1, 1 << 31) + struct.pack(">Q", ELEMENT_BYTES) + struct.pack(">Q", crc64(body))
    )  # fmt: skip
    assert message.pack() == header + body


def test_the_checksum_is_that_of_pyigtl_and_of_the_standard() -> None:
    assert crc64(b"123456789") == 0x6C40DF5F0B497347  # the check value of CRC-64/ECMA-182
    for content in (b"", b"123456789", bytes(range(256))):
        assert CRC64(content) == crc64(content)


def test_tdata_comes_back(summary: SurgerySummary) -> None:
    message = stage_messages(summary.stages[0], SURGERY)[-1]
    again = received(message.pack())
    assert isinstance(again, TrackingDataMessage)
    assert [tool.name for tool in again.tools] == [tool.name for tool in message.tools]
    for tool, sent in zip(again.tools, message.tools, strict=True):
        np.testing.assert_allclose(tool.matrix, sent.matrix, atol=1e-4)
        assert tool.kind == 2
    assert again.metadata["Lost"] == "T5 T6 L2"
    assert "T9ToSpine" in again.content_asstring()


def test_every_vertebra_has_its_transform_in_ras(summary: SurgerySummary) -> None:
    *transforms, tracking = stage_messages(summary.stages[2], SURGERY)
    assert [message.device_name for message in transforms] == [tool.name for tool in tracking.tools]
    message = received(transforms[4].pack())
    body = pose("T9", 2)
    np.testing.assert_allclose(
        message.matrix, transform(RAS_FROM_PATIENT, body.rotation, body.position_mm), atol=1e-4
    )
    assert message.device_name == "T9ToSpine"
    assert message.timestamp == pytest.approx(summary.stages[2].created_at.timestamp())
    expected = {
        "Status": "OK", "TransformStatus": "OK", "Vertebra": "T9", "Origin": "measured", "Stage": "POST",
        "Take": "1", "SurgeryId": SURGERY, "PositionSdAnteriorLeftCephaladMm": "0.3 0.3 0.5",
        "CoordinateSystem": "RAS, mm", "Baseline": "PRE",
    }  # fmt: skip
    assert expected.items() <= message.metadata.items()
    assert message.metadata["Frame"].startswith("patient axes at stage PRE, fixed to L1")


def test_a_lost_vertebra_is_sent_as_lost(summary: SurgerySummary) -> None:
    first, *_, tracking = stage_messages(summary.stages[0], SURGERY)
    lost = received(first.pack())
    assert lost.device_name == "T5ToSpine"
    assert (lost.metadata["Status"], lost.metadata["TransformStatus"]) == ("LOST", "MISSING")
    assert lost.metadata["Reason"] == "it lies outside the marked vertebrae T7 to L1"
    assert np.isnan(lost.matrix[:3]).all()
    tool = tracking.tools[0]
    assert tool.name == "T5ToSpine"
    assert np.isnan(tool.matrix[:3]).all()


def test_a_vertebra_that_was_sent_before_and_is_no_more_is_lost(summary: SurgerySummary) -> None:
    messages = stage_messages(summary.stages[0], SURGERY, ["T9", "T1"])
    assert len(messages) == 12
    *_, gone, tracking = messages
    assert (gone.device_name, gone.metadata["Status"]) == ("T1ToSpine", "LOST")
    assert np.isnan(received(gone.pack()).matrix[:3]).all()
    assert tracking.metadata["Lost"] == "T5 T6 L2 T1"


def test_every_vertebra_of_a_stage_without_a_spine_is_lost(summary: SurgerySummary) -> None:
    *transforms, tracking = stage_messages(summary.stages[3], SURGERY, ["T9", "L1"])
    assert [message.device_name for message in transforms] == ["T9ToSpine", "L1ToSpine"]
    for message in transforms:
        lost = received(message.pack())
        assert np.isnan(lost.matrix[:3]).all()
        assert (lost.metadata["Status"], lost.metadata["Stage"]) == ("LOST", "EXTRA")
        assert lost.metadata["Reason"] == lost.metadata["NoSpine"] == "the stage was not measured"
    assert received(tracking.pack()).metadata["Lost"] == "T9 L1"


def test_a_stage_without_a_spine_and_without_former_vertebrae_has_no_messages(
    summary: SurgerySummary,
) -> None:
    assert stage_messages(summary.stages[3], SURGERY) == []


@pytest.mark.parametrize("name", ["", "a" * 21, "é", "tab\t", "nul\0"])
def test_names_that_the_protocol_cannot_carry_are_refused(name: str) -> None:
    with pytest.raises(DeviceNameError, match="1 to 20 printable ASCII"):
        device_name(name)
    message = TrackingDataMessage([TrackedTool(name, np.eye(4))], timestamp=0.0, device_name="Spine")
    with pytest.raises(DeviceNameError):
        message.pack()


def test_twenty_characters_are_allowed() -> None:
    assert device_name("a" * 20) == b"a" * 20


@pytest.mark.parametrize("text", TEXTS)
def test_hostile_text_is_packed_as_one_line_of_ascii(text: str) -> None:
    messages = stage_messages(with_text(text).stages[0], text)
    values = [value for message in messages for value in received(message.pack()).metadata.values()]
    assert len(values) > len(messages) > 1
    for value in values:
        assert value.isascii()
        assert len(value.splitlines()) <= 1


def test_sixty_stages() -> None:
    whole = many_stages()
    packed = [message.pack() for stage in whole.stages for message in stage_messages(stage, SURGERY)]
    assert len(packed) == 60 * 18
