from spinewatch.spine.configuration import Origin
from spinewatch.spine.results import Curve, MeasureStatus


def test_stored_words_do_not_change() -> None:
    assert [status.value for status in MeasureStatus] == ["measured", "bracketed", "not_measured"]
    assert MeasureStatus.NOT_MEASURED.value == Origin.NOT_MEASURED.value


def test_a_curve_has_closed_ends_unless_it_says_otherwise() -> None:
    assert Curve("curve 1", "T5", "T8", "T12", "right").open_ends == ()
