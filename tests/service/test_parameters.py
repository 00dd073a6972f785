from datetime import UTC, datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.parameters import parse_time, require_plausible_time
from service.problems import InvalidInputError

NOW = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)


@given(
    st.datetimes(datetime(2, 1, 1), datetime(9998, 1, 1)),
    st.integers(-23, 23),
)
def test_a_time_in_any_zone_becomes_the_same_instant_in_utc(time: datetime, hours: int) -> None:
    zoned = time.replace(tzinfo=timezone(timedelta(hours=hours)))
    parsed = parse_time(zoned.isoformat())
    assert parsed == zoned
    assert parsed.tzinfo is UTC


@pytest.mark.parametrize(
    "text", ["2026-11-21T09:30:00Z", "2026-11-21t09:30:00z", "2026-11-21T10:30:00+01:00"]
)
def test_spellings_of_one_instant(text: str) -> None:
    assert parse_time(text) == datetime(2026, 11, 21, 9, 30, tzinfo=UTC)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "today",
        "2026-11-21",
        "2026-11-21T09:30:00",
        "2026-11-21 09:30:00Z",
        "2026-11-21T09:30Z",
        "2026-13-21T09:30:00Z",
        "2026-11-21T09:30:00+01",
        "0001-01-01T00:00:00+23:59",
        "9999-12-31T23:59:59-23:59",
    ],
)
def test_what_is_not_a_time_with_a_zone_is_an_error(text: str) -> None:
    with pytest.raises(ValueError, match=r"RFC 3339|years|month|hour"):
        parse_time(text)


def test_fractions_of_a_second_are_cut_to_microseconds() -> None:
    expected = datetime(2026, 11, 21, 9, 30, 0, 123456, tzinfo=UTC)
    assert parse_time("2026-11-21T09:30:00.1234567Z") == expected
    assert parse_time("2026-11-21T10:30:00.123456999999+01:00") == expected
    assert parse_time("2026-11-21T09:30:00.5Z") == datetime(2026, 11, 21, 9, 30, 0, 500_000, tzinfo=UTC)


def test_a_plus_that_was_not_escaped_is_named() -> None:
    with pytest.raises(ValueError, match="%2B"):
        parse_time("2026-11-21T10:30:00 01:00")


@pytest.mark.parametrize(
    ("time", "problem"),
    [
        (datetime(1970, 1, 1, tzinfo=UTC), "1970-01-01T00:00:00.* is before 2000"),
        (datetime(2099, 1, 1, tzinfo=UTC), "2099-01-01T00:00:00.* is in the future"),
        (NOW + timedelta(minutes=6), "in the future"),
    ],
)
def test_an_implausible_time_is_refused_by_name(time: datetime, problem: str) -> None:
    with pytest.raises(InvalidInputError, match=problem) as refused:
        require_plausible_time("captured_at", time, NOW, timedelta(minutes=5), "query")
    assert (refused.value.code, refused.value.loc) == ("time-implausible", ["query", "captured_at"])


@pytest.mark.parametrize("time", [None, NOW, NOW + timedelta(minutes=5), datetime(2000, 1, 1, tzinfo=UTC)])
def test_other_times_are_accepted(time: datetime | None) -> None:
    require_plausible_time("captured_at", time, NOW, timedelta(minutes=5))


def test_a_value_that_is_not_text_is_left_to_pydantic() -> None:
    assert parse_time(17) == 17
