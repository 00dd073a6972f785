"""CSV after RFC 4180, safe to open in a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

Cell = str | float | int | bool | None
"""What a cell holds; None is an empty cell."""

_FORMULA = tuple("=+-@\t\r\n＝＋－＠")
_MARK = "'"


def csv_table(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    r"""Return a table as CSV.

    Parameters
    ----------
    header
        Names of the columns, with their units.
    rows
        Cells of each row. Text that a spreadsheet would run as a formula is made harmless by `harmless`; numbers are
        written with all their digits, truth values as true and false.

    Returns
    -------
    bytes
        UTF-8, lines ended by CR LF.

    Examples
    --------
    >>> csv_table(["name", "x_mm"], [["=1+1", -2.5], ["a,b", None]])
    b'name,x_mm\r\n\'=1+1,-2.5\r\n"a,b",\r\n'
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(header)
    writer.writerows([_written(cell) for cell in row] for row in rows)
    return text.getvalue().encode()


def harmless(text: str) -> str:
    """Return a text that no spreadsheet runs as a formula.

    Parameters
    ----------
    text
        Any text.

    Returns
    -------
    str
        The text without NUL; with an apostrophe before it if it begins with ``= + - @``, their full-width forms, a tab
        or a line end, also after spaces, or with an apostrophe, so that the original can be read back by taking one
        leading apostrophe away.

    References
    ----------
    OWASP, CSV Injection.

    Examples
    --------
    >>> harmless("@SUM(A1)"), harmless("T9"), harmless("'")
    ("'@SUM(A1)", 'T9', "''")
    """
    text = text.replace("\x00", "\ufffd")
    return _MARK + text if text.startswith(_MARK) or text.lstrip(" ").startswith(_FORMULA) else text


def _written(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    return harmless(cell) if isinstance(cell, str) else repr(cell)
