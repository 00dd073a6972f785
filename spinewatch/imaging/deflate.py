"""Check of data compressed with Deflate in the zlib format, which ends with a checksum of what was compressed."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence

_PIECE = 1 << 14
_STEP = 1 << 18


def inflates_to(size: int, parts: Sequence[bytes | memoryview]) -> bool:
    """Return whether compressed data are sound and have a size when inflated.

    The data are inflated in pieces that are not kept, and no further than the size.

    Parameters
    ----------
    size
        Bytes that were compressed.
    parts
        Parts of the compressed data, in order.

    Returns
    -------
    bool
        False if the data are damaged, too short or too long, or if bytes follow them.

    References
    ----------
    RFC 1950, section 2.2 (Adler-32).

    Examples
    --------
    >>> inflates_to(5, [zlib.compress(b"12345")]), inflates_to(4, [zlib.compress(b"12345")])
    (True, False)
    """
    inflate, left = zlib.decompressobj(), size
    pieces = (part[start : start + _PIECE] for part in parts for start in range(0, len(part), _PIECE))
    try:
        for piece in pieces:
            if inflate.eof:
                return False
            for inflated in _inflated(inflate, piece):
                left -= inflated
                if left < 0:
                    return False
    except zlib.error:
        return False
    return inflate.eof and left == 0 and not inflate.unused_data


def _inflated(inflate: zlib._Decompress, piece: bytes | memoryview) -> Iterator[int]:
    """Yield the sizes of what a piece of compressed data is inflated to, bytes, in limited steps."""
    size = _STEP
    while (piece or size == _STEP) and not inflate.eof:  # zlib keeps giving surplus bytes back
        size = len(inflate.decompress(piece, _STEP))
        piece = inflate.unconsumed_tail
        yield size
