"""TIFF files without metadata: a new directory of the tags that pixels need, and the strips or tiles as they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from spinewatch.errors import ImageError

_STRIPS, _STRIP_BYTES, _TILES, _TILE_BYTES = 273, 279, 324, 325
_PIXEL_TAGS = frozenset(
    {254, 256, 257, 258, 259, 262, 263, 266, 273, 274, 277, 278, 279, 280, 281, 282, 283, 284, 292, 293, 296}
    | {317, 320, 322, 323, 324, 325, 332, 338, 339, 347, 529, 530, 531, 532}
)
"""Tags that say how pixels are stored, and the resolution."""
_COMPRESSION, _OLD_JPEG = 259, 6
_LONG, _LONG8 = 4, 16
_MAX_VALUES = 1 << 16
_VALUE_BYTES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
_DAMAGED = "the TIFF file is damaged or incomplete; copy it again"
_EXPORT = "the metadata of the TIFF file cannot be removed; export it again as TIFF or PNG without metadata"


@dataclass(frozen=True)
class _Entry:
    """An entry of the directory with its values as bytes, and where these are when they do not fit in."""

    tag: int
    kind: int
    count: int
    values: bytes
    place: int | None


@dataclass(frozen=True)
class _Form:
    """Byte order, and the widths of fields: those of TIFF, or of BigTIFF."""

    order: Literal["little", "big"]
    is_big: bool

    @property
    def offset(self) -> int:
        """Bytes of an offset and of a number of values."""
        return 8 if self.is_big else 4

    @property
    def number(self) -> int:
        """Bytes of the number of entries."""
        return 8 if self.is_big else 2

    def unpack(self, field: bytes) -> int:
        return int.from_bytes(field, self.order)

    def pack(self, value: int, size: int) -> bytes:
        return value.to_bytes(size, self.order)


def tiff_without_metadata(data: bytes) -> bytes:
    """Return a TIFF file without metadata.

    Parameters
    ----------
    data
        Contents of a file that `spinewatch.imaging.tiff_directory.tiff_size` accepts.

    Returns
    -------
    bytes
        The file; the same bytes if every byte belongs to the pixels, to tags that they need, or is zero.

    Raises
    ------
    ImageError
        If strips or tiles are outside the file, overlap, or are not listed with their sizes.
    """
    form = _Form("little" if data[:2] == b"II" else "big", data[2:4] in (b"+\0", b"\0+"))
    start = form.unpack(data[8:16] if form.is_big else data[4:8])
    entries = _entries(data, form, start)
    kept = {entry.tag: entry for entry in entries if entry.tag in _PIXEL_TAGS}
    if _COMPRESSION in kept and form.unpack(kept[_COMPRESSION].values) == _OLD_JPEG:
        raise ImageError(_EXPORT)
    segments = _segments(data, form, kept)
    if len(kept) == len(entries) and _nothing_else(data, form, start, entries, segments):
        return data
    return _written(data, form, kept, segments)


def _entries(data: bytes, form: _Form, start: int) -> list[_Entry]:
    size = 4 + 2 * form.offset
    entries = []
    for index in range(form.unpack(data[start : start + form.number])):
        field = data[start + form.number + index * size :][:size]
        tag, kind = form.unpack(field[:2]), form.unpack(field[2:4])
        count = form.unpack(field[4 : 4 + form.offset])
        value_bytes = count * _VALUE_BYTES.get(kind, 1)
        place = None if value_bytes <= form.offset else form.unpack(field[4 + form.offset :])
        if tag not in _PIXEL_TAGS:
            entries.append(_Entry(tag, kind, 0, b"", None))
            continue
        values = (
            field[4 + form.offset :][:value_bytes] if place is None else data[place : place + value_bytes]
        )
        if len(values) < value_bytes or count > _MAX_VALUES or kind not in _VALUE_BYTES:
            raise ImageError(_DAMAGED)
        entries.append(_Entry(tag, kind, count, values, place))
    return entries


def _numbers(form: _Form, entry: _Entry) -> list[int]:
    size = _VALUE_BYTES[entry.kind]
    return [form.unpack(entry.values[n : n + size]) for n in range(0, size * entry.count, size)]


def _segments(data: bytes, form: _Form, kept: Mapping[int, _Entry]) -> list[tuple[int, int]]:
    """Return place and size of every strip or tile, in the order of the directory."""
    places, sizes = (_TILES, _TILE_BYTES) if _TILES in kept else (_STRIPS, _STRIP_BYTES)
    if places not in kept or sizes not in kept or kept[places].count != kept[sizes].count:
        raise ImageError(_EXPORT)
    segments = list(zip(_numbers(form, kept[places]), _numbers(form, kept[sizes]), strict=True))
    if any(place + size > len(data) for place, size in segments) or sum(s for _, s in segments) > len(data):
        raise ImageError(_DAMAGED)
    return segments


def _nothing_else(
    data: bytes, form: _Form, start: int, entries: Sequence[_Entry], segments: Sequence[tuple[int, int]]
) -> bool:
    """Return whether all other bytes are zero."""
    header = 16 if form.is_big else 8
    directory = form.number + len(entries) * (4 + 2 * form.offset) + form.offset
    used = [(0, header), (start, directory), *segments]
    used += [(entry.place, len(entry.values)) for entry in entries if entry.place is not None]
    end = 0
    for place, size in sorted(used):
        if place > end and data[end:place].strip(b"\0"):
            return False
        end = max(end, place + size)
    return not data[end:].strip(b"\0")


def _written(
    data: bytes, form: _Form, kept: Mapping[int, _Entry], segments: Sequence[tuple[int, int]]
) -> bytes:
    """Return a file of header, strips or tiles, long values, and directory."""
    position = 16 if form.is_big else 8
    parts, places = [], []
    for place, size in segments:
        places.append(position)
        parts.append(data[place : place + size] + b"\0" * (size % 2))
        position += size + size % 2
    offset_tag = _TILES if _TILES in kept else _STRIPS
    fields = []
    for tag, entry in sorted(kept.items()):
        kind, values = entry.kind, entry.values
        if tag == offset_tag:
            kind = _LONG8 if form.is_big else _LONG
            values = b"".join(form.pack(place, form.offset) for place in places)
        field = form.pack(tag, 2) + form.pack(kind, 2) + form.pack(entry.count, form.offset)
        if len(values) <= form.offset:
            fields.append(field + values.ljust(form.offset, b"\0"))
            continue
        fields.append(field + form.pack(position, form.offset))
        padding = b"\0" * (len(values) % 2)
        parts.append(values + padding)
        position += len(values) + len(padding)
    if not form.is_big and position >= 1 << 32:
        raise ImageError(_EXPORT)
    header = data[:8] + form.pack(position, 8) if form.is_big else data[:4] + form.pack(position, 4)
    directory = form.pack(len(fields), form.number) + b"".join(fields) + bytes(form.offset)
    return b"".join((header, *parts, directory))
