"""Check of data compressed with LZW as in TIFF, which has no checksum.

The data are not decoded. Their codes say how long the decoded data are, and whether an encoder chose them: it takes the
longest string that it knows, so that it never adds a string twice. Damaged codes rarely do both.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Int

_CLEAR, _END, _FIRST = 256, 257, 258
_FULL_CODES = 3838
"""Codes after a clear code until the table has 4095 entries."""
_WIDTHS = np.repeat([9, 10, 11, 12], [254, 512, 1024, _FULL_CODES - 1790])
"""Bits of each code after a clear code: one more when entries 510, 1022 and 2046 are made."""
_STARTS = np.concatenate([[0], np.cumsum(_WIDTHS)])
_FEWEST_CODES = 64
"""Codes between two clear codes at least, which bounds the cost; encoders clear a table that is full or of no use."""


def lzw_expands_to(size: int, data: bytes) -> bool:
    """Return whether compressed data are codes that an encoder writes for a number of bytes, with the end code.

    Parameters
    ----------
    size
        Bytes that were compressed.
    data
        The codes, most significant bit first. Bytes after the end code are not looked at.

    Returns
    -------
    bool
        False if the data are too short or too long, have a code that is not defined yet or no end code, or define a
        string twice.

    References
    ----------
    TIFF 6.0 (Adobe, 1992), section 13.

    Examples
    --------
    >>> data = bytes.fromhex("800000202808")  # clear, 0, 1, 2, end
    >>> lzw_expands_to(3, data), lzw_expands_to(2, data)
    (True, False)
    """
    padded = np.frombuffer(data + bytes(3), np.uint8).astype(np.int64)
    n_bits, position, left = 8 * len(data), 0, size
    while True:
        codes = _codes(padded, position, n_bits)
        stops = np.flatnonzero((codes == _CLEAR) | (codes == _END))
        if not stops.size or (position == 0 and (stops[0] > 0 or codes[0] == _END)):
            return False
        is_end, n_codes = bool(codes[stops[0]] == _END), int(stops[0])
        if not is_end and position > 0 and n_codes < _FEWEST_CODES:
            return False
        expanded = _expanded_size(codes[:n_codes])
        if expanded is None or expanded > left:
            return False
        left -= expanded
        if is_end:
            return left == 0
        position += int(_STARTS[n_codes + 1])


def _codes(data: Int, position: int, n_bits: int) -> Int:
    """Return the codes that follow a clear code, at most as many as until the next one."""
    starts, widths = position + _STARTS[:-1], _WIDTHS
    n_whole = int(np.searchsorted(starts + widths, n_bits, side="right"))
    starts, widths = starts[:n_whole], widths[:n_whole]
    first = starts >> 3
    three_bytes = (data[first] << 16) | (data[first + 1] << 8) | data[first + 2]
    codes: Int = (three_bytes >> (24 - (starts & 7) - widths)) & ((1 << widths) - 1)
    return codes


def _expanded_size(codes: Int) -> int | None:
    """Return the bytes that the codes after a clear code expand to; None if no encoder writes them."""
    if not codes.size:
        return 0
    if np.any(codes >= _FIRST + np.arange(codes.size)):
        return None
    # entry 258 + j is the string of code j and the first byte of that of code j + 1
    before = np.concatenate([np.arange(_FIRST), codes[:-1]])
    lengths = np.concatenate([np.zeros(_FIRST, np.int64), np.ones(codes.size - 1, np.int64)])
    while np.any(before >= _FIRST):
        lengths += lengths[before]
        before = before[before]
    strings = codes[:-1] * _CLEAR + before[codes[1:]]
    if np.unique(strings).size < strings.size:
        return None
    return int(lengths[codes].sum()) + codes.size
