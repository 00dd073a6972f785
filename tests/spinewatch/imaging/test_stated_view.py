"""A view or a side that a DICOM file contradicts is refused."""

import pytest

from spinewatch.imaging.stated_view import RadiographViewError, StatedView, require_view


@pytest.mark.parametrize(
    ("stated", "view", "side"),
    [
        (("", "", ""), "pa", "left"),
        (("PA", "L", "F"), "pa", "right"),
        (("AP", "R", "F"), "pa", "left"),
        (("pa", "LA", "FP"), "pa", "right"),
        (("LL", "A", "F"), "lateral", "right"),
        (("RLAT", "P", "F"), "lateral", "left"),
        (("", "A", ""), "lateral", "right"),
        (("", "", "F"), "lateral", "right"),
        (("XYZ", "LE", "V"), "pa", "left"),
        (("", "CR", "CD"), "pa", "left"),
    ],
)
def test_what_agrees_or_is_not_stated_is_accepted(stated: tuple[str, str, str], view: str, side: str) -> None:
    require_view(StatedView(*stated), view, side)


@pytest.mark.parametrize(
    ("stated", "view", "side", "message"),
    [
        (
            ("", "L", "F"),
            "pa",
            "left",
            "left is on the right of the image, and the request says left; correct left_on",
        ),
        (("", "R", "F"), "pa", "right", "left is on the left of the image, and the request says right"),
        (("", "A", "F"), "lateral", "left", "front is on the right of the image, .*; correct anterior_on"),
        (("", "PL", ""), "lateral", "right", "front is on the left of the image"),
        (("", "L", "H"), "pa", "right", "head is at the bottom"),
        (("", "", "H"), "lateral", "right", "head is at the bottom"),
        (("", "F", "L"), "pa", "right", "left is at the bottom"),
        (("", "A", "F"), "pa", "right", "front is on the right of the image, which is not so in a pa view"),
        (
            ("", "L", "F"),
            "lateral",
            "right",
            "left is on the right of the image, which is not so in a lateral view",
        ),
        (("", "H", ""), "pa", "left", "head is on the right"),
        (("LL", "", ""), "pa", "left", "its view is LL, and the request says pa"),
        (("rlat", "", ""), "pa", "left", "its view is RLAT"),
        (("AP", "", ""), "lateral", "left", "its view is AP, and the request says lateral"),
        (("PA", "", ""), "lateral", "left", "its view is PA"),
        (("RLO", "", ""), "lateral", "left", "its view is RLO"),
    ],
)
def test_what_contradicts_is_refused(
    stated: tuple[str, str, str], view: str, side: str, message: str
) -> None:
    with pytest.raises(RadiographViewError, match=message):
        require_view(StatedView(*stated), view, side)
