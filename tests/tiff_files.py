"""TIFF files of layouts that Pillow reads and does not write."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from typing import Any, Literal

import numpy as np
from PIL import Image

_NONE, _LZW, _PACKBITS = 1, 5, 32773
_REVERSED_BITS = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_ROWS = 64
_SHORT, _LONG = 3, 4


def tiff(  # noqa: PLR0913 - one each for what files differ in
    image: np.ndarray[Any, Any],
    bits: int,
    *,
    compression: int = _NONE,
    order: Literal["<", ">"] = "<",
    photometric: int | None = None,
    planar: int = 1,
    predictor: int = 1,
    fill_order: int = 1,
    tile: tuple[int, int] | None = None,
    orientation: int = 1,
    is_big: bool = False,
) -> bytes:
    """Return an image (H, W) or (H, W, samples) of 8 or 16 bits as a TIFF file of strips of 64 rows or of tiles."""
    height, width = image.shape[:2]
    samples = 1 if image.ndim == 2 else image.shape[2]
    kind = np.dtype(np.uint8 if bits == 8 else f"{order}u2")
    planes = [image[..., k] for k in range(samples)] if planar == 2 and samples > 1 else [image]
    packed = [
        _packed(block.astype(kind), compression)
        for plane in planes
        for block in _blocks(_differences(plane, bits) if predictor == 2 and not tile else plane, tile)
    ]
    if fill_order == 2:
        packed = [block.translate(_REVERSED_BITS) for block in packed]
    colour = 1 if samples == 1 else 2
    entries: dict[int, tuple[int, list[int]]] = {
        256: (_SHORT, [width]),
        257: (_SHORT, [height]),
        258: (_SHORT, [bits] * samples),
        259: (_SHORT, [compression]),
        262: (_SHORT, [colour if photometric is None else photometric]),
        266: (_SHORT, [fill_order]),
        274: (_SHORT, [orientation]),
        277: (_SHORT, [samples]),
        284: (_SHORT, [planar]),
        317: (_SHORT, [predictor]),
    }
    if tile:
        entries |= {322: (_SHORT, [tile[0]]), 323: (_SHORT, [tile[1]])}
    else:
        entries |= {278: (_SHORT, [_ROWS])}
    return _file(entries, packed, (324, 325) if tile else (273, 279), order, is_big)


def _blocks(plane: np.ndarray[Any, Any], tile: tuple[int, int] | None) -> list[np.ndarray[Any, Any]]:
    if tile is None:
        return [plane[top : top + _ROWS] for top in range(0, len(plane), _ROWS)]
    across, down = tile
    height, width = plane.shape[:2]
    beyond = [(0, -height % down), (0, -width % across), *[(0, 0)] * (plane.ndim - 2)]
    padded = np.pad(plane, beyond)
    return [
        padded[top : top + down, left : left + across]
        for top in range(0, height, down)
        for left in range(0, width, across)
    ]


def _differences(plane: np.ndarray[Any, Any], bits: int) -> np.ndarray[Any, Any]:
    differences = plane.astype(np.int64)
    differences[:, 1:] -= plane[:, :-1].astype(np.int64)
    return differences & ((1 << bits) - 1)


def _packed(block: np.ndarray[Any, Any], compression: int) -> bytes:
    content = np.ascontiguousarray(block).tobytes()
    if compression == _NONE:
        return content
    if compression == _LZW:
        return _of_libtiff(content, "tiff_lzw")
    if compression == _PACKBITS:
        row = len(content) // len(block)
        rows = (content[start : start + row] for start in range(0, len(content), row))
        return b"".join(_of_libtiff(each, "packbits") for each in rows)
    return zlib.compress(content)


def _of_libtiff(content: bytes, compression: str) -> bytes:
    """Return bytes as libtiff packs one row of them."""
    buffer = BytesIO()
    Image.frombytes("L", (len(content), 1), content).save(buffer, "TIFF", compression=compression)
    with Image.open(buffer) as image:
        (place,), (size,) = image.tag_v2[273], image.tag_v2[279]  # type: ignore[attr-defined]
    return buffer.getvalue()[place : place + size]


def _file(
    entries: dict[int, tuple[int, list[int]]],
    blocks: list[bytes],
    tags: tuple[int, int],
    order: Literal["<", ">"],
    is_big: bool,
) -> bytes:
    offset = "Q" if is_big else "I"
    position, body, places = (16 if is_big else 8), b"", []
    for block in blocks:
        places.append(position + len(body))
        body += block + bytes(len(block) % 2)
    entries |= {tags[0]: (_LONG, places), tags[1]: (_LONG, [len(block) for block in blocks])}
    position += len(body)
    fields, values = b"", b""
    for tag, (kind, numbers) in sorted(entries.items()):
        value = struct.pack(f"{order}{len(numbers)}{'H' if kind == _SHORT else 'I'}", *numbers)
        if len(value) > struct.calcsize(f"={offset}"):
            place = struct.pack(f"{order}{offset}", position + len(values))
            values += value + bytes(len(value) % 2)
            value = place
        fields += struct.pack(f"{order}HH{offset}", tag, kind, len(numbers)) + value.ljust(
            8 if is_big else 4, b"\0"
        )
    directory, number = position + len(values), struct.pack(f"{order}{'Q' if is_big else 'H'}", len(entries))
    name = b"II" if order == "<" else b"MM"
    head = (
        struct.pack(f"{order}HHHQ", 43, 8, 0, directory)
        if is_big
        else struct.pack(f"{order}HI", 42, directory)
    )
    return name + head + body + values + number + fields + bytes(8 if is_big else 4)
