"""What a DICOM file says of the view and the sides of its radiograph, against what is said of it otherwise."""

from __future__ import annotations

from dataclasses import dataclass

from spinewatch.errors import ImageError

_FRONTAL = frozenset({"AP", "PA"})
_LATERAL = frozenset({"LL", "RL", "LLAT", "RLAT", "LAT"})
_OBLIQUE = frozenset({"LLO", "RLO", "LAO", "RAO", "LPO", "RPO"})
_POSITIVE = {"pa": ("L", "R", "left"), "lateral": ("A", "P", "anterior")}
"""By view: the direction that is asked for, its opposite and its name."""
_SIDES = {"L": "left", "R": "right", "A": "front", "P": "back", "H": "head", "F": "feet"}


class RadiographViewError(ImageError):
    """A DICOM file says another view or other sides of its radiograph than the request."""

    code = "radiograph-view-contradicted"


@dataclass(frozen=True)
class StatedView:
    """View and sides according to a DICOM file; what it does not say is empty.

    Attributes
    ----------
    view_position
        View Position, for example PA or LL.
    rows, columns
        Direction in the patient of the rows (to the right) and of the columns (downwards), from Patient Orientation;
        the first letter is the main direction.
    """

    view_position: str = ""
    rows: str = ""
    columns: str = ""


NOTHING_STATED = StatedView()
"""What image files other than DICOM say."""


def require_view(stated: StatedView, view: str, positive_on: str) -> None:
    """Refuse a view or a side that contradicts the file.

    Parameters
    ----------
    stated
        What the file says.
    view
        The view: ``pa`` or ``lateral``.
    positive_on
        Side of the image, ``left`` or ``right``, of the patient's left (PA) or front (lateral).

    Raises
    ------
    RadiographViewError
        If the file says another view, another side, or that the head is not at the top. Values that the standard does
        not define for people count as not stated.

    References
    ----------
    DICOM PS3.3 C.7.6.1.1.1 (Patient Orientation) and C.8.7.1 (View Position).

    Examples
    --------
    >>> require_view(StatedView("PA", "L", "F"), "pa", "right")
    >>> require_view(StatedView("", "L", "F"), "pa", "left")
    Traceback (most recent call last):
    spinewatch.imaging.stated_view.RadiographViewError: the file says that the patient's left is on the right of the\
 image, and the request says left; correct left_on, or export the image again
    """
    position = stated.view_position.upper()
    if position in (_LATERAL if view == "pa" else _FRONTAL) | _OBLIQUE:
        raise RadiographViewError(
            f"the file says that its view is {position}, and the request says {view}; send a frontal radiograph as pa,"
            " a lateral one as lateral, and no oblique one"
        )
    columns, rows = _main(stated.columns), _main(stated.rows)
    if columns not in ("", "F"):
        raise RadiographViewError(
            f"the file says that the patient's {_SIDES[columns]} is at the bottom of the image; send it with the head"
            " at the top"
        )
    positive, negative, name = _POSITIVE[view]
    if rows not in ("", positive, negative):
        raise RadiographViewError(
            f"the file says that the patient's {_SIDES[rows]} is on the right of the image, which is not so in a {view}"
            " view; correct view, or export the image again"
        )
    side = {positive: "right", negative: "left"}.get(rows, positive_on)
    if side != positive_on:
        raise RadiographViewError(
            f"the file says that the patient's {_SIDES[positive]} is on the {side} of the image, and the request says"
            f" {positive_on}; correct {name}_on, or export the image again"
        )


def _main(direction: str) -> str:
    """Return the main direction of an orientation; empty if there is none, or not one of people."""
    letters = direction.strip().upper()
    return letters[:1] if set(letters) <= set(_SIDES) else ""
