import pytest

from spinewatch.errors import SpinewatchError
from store import errors

ERRORS = [
    kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, SpinewatchError) and kind.__module__ == errors.__name__
]


@pytest.mark.parametrize("kind", ERRORS)
def test_every_error_has_a_code_of_its_own(kind: type[SpinewatchError]) -> None:
    codes = [other.code for other in ERRORS if other is not errors.ReportNotFoundError]
    assert codes.count(kind.code) == 1


def test_what_was_not_found_is_in_the_code() -> None:
    assert errors.NotFoundError("surgery").code == "surgery-not-found"
    assert errors.ReportNotFoundError().code == "report-not-found"
    assert "rig" in str(errors.ReportNotFoundError())
