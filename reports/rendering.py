"""Rendering of the templates in ``reports/templates``, with everything escaped that is inserted."""

from __future__ import annotations

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

UNKNOWN = "–"


def render(template: str, **context: Any) -> str:
    """Return a report as HTML.

    Parameters
    ----------
    template
        Name of a file in ``reports/templates``.
    context
        Variables of the template. Text in them is escaped.

    Returns
    -------
    str
        One HTML page that refers to no other file.
    """
    return _ENVIRONMENT.get_template(template).render(context)


def format_number(value: float | None, spec: str) -> str:
    """Return a number as text.

    Parameters
    ----------
    value
        The number; None if it is unknown.
    spec
        Format specification, such as ``.3f``.

    Returns
    -------
    str
        The formatted number, or an en dash for None.

    Examples
    --------
    >>> format_number(0.1234, ".2f"), format_number(None, ".2f")
    ('0.12', '–')
    """
    return UNKNOWN if value is None else format(value, spec)


_ENVIRONMENT = Environment(
    loader=PackageLoader("reports"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)
_ENVIRONMENT.filters["number"] = format_number
