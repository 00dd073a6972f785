"""Mutations of files: changed, repeated, removed and exchanged bytes, and numbers at the limits of their range."""

from __future__ import annotations

import zlib

import numpy as np

_MOST_CHANGES = 6
_LARGEST = 200_000
_LIMITS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def mutate(rng: np.random.Generator, known: list[bytes]) -> bytes:
    """Return one of the known files with some changes; a PNG keeps the checksums of its chunks."""
    data = bytearray(known[rng.integers(len(known))])
    for _ in range(rng.integers(1, _MOST_CHANGES + 1)):
        _change(rng, data, known)
    return bytes(_with_checksums(data) if rng.random() < 0.7 else data)[:_LARGEST]


def _change(rng: np.random.Generator, data: bytearray, known: list[bytes]) -> None:
    # headers decide most, so half of the changes are near the start
    span = len(data) if rng.random() < 0.5 else min(len(data), 200)
    at = int(rng.integers(span + 1))
    kind = rng.integers(7)
    if kind == 0:
        data[at : at + 1] = bytes([rng.integers(256)])
    elif kind == 1 and at < len(data):
        data[at] ^= 1 << int(rng.integers(8))
    elif kind == 2:
        width = int(rng.choice([1, 2, 4]))
        order = "little" if rng.random() < 0.5 else "big"
        value = int(rng.choice(_LIMITS)) & ((1 << 8 * width) - 1)
        data[at : at + width] = value.to_bytes(width, order)  # type: ignore[arg-type]
    elif kind == 3:
        del data[at : at + int(rng.integers(1, 40))]
    elif kind == 4:
        data[at:at] = data[at : at + int(rng.integers(1, 200))] * int(rng.integers(1, 4))
    elif kind == 5:
        other = known[rng.integers(len(known))]
        start = int(rng.integers(len(other) + 1))
        data[at : at + 50] = other[start : start + int(rng.integers(1, 400))]
    else:
        del data[max(at, 16) :]


def _with_checksums(data: bytearray) -> bytearray:
    """Return a PNG with the right checksum in each chunk, so that its content is looked at; other files as they are."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        return data
    at = 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        end = at + 8 + length
        if end + 4 > len(data):
            break
        data[end : end + 4] = zlib.crc32(data[at + 4 : end]).to_bytes(4, "big")
        at = end + 4
    return data
