"""Check of data compressed with PackBits, which have neither a checksum nor an end code."""

from __future__ import annotations

_NOTHING = 128


def packbits_expand_to(row: int, n_rows: int, data: bytes) -> bool:
    """Return whether compressed data are exactly some rows, each packed by itself.

    Parameters
    ----------
    row
        Bytes of a row.
    n_rows
        Number of rows.
    data
        The compressed data.

    Returns
    -------
    bool
        False if the data end too early or too late, or if a run goes beyond the end of its row. Damage of bytes that
        are stored as they are changes them alone, and is not detected.

    References
    ----------
    TIFF 6.0 (Adobe, 1992), section 9.

    Examples
    --------
    >>> packbits_expand_to(3, 2, bytes([254, 7, 2, 1, 2, 3])), packbits_expand_to(2, 3, bytes([254, 7, 2, 1, 2, 3]))
    (True, False)
    """
    position, left, rows_left = 0, row, n_rows
    while position < len(data) and rows_left:
        head = data[position]
        if head < _NOTHING:
            position += head + 2
            left -= head + 1
        elif head == _NOTHING:
            position += 1
        else:
            position += 2
            left -= 257 - head
        if left < 0:
            return False
        if left == 0:
            left, rows_left = row, rows_left - 1
    return position == len(data) and rows_left == 0
