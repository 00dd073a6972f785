"""Values of parameters: what any default admits, on the parameters of the method itself."""

from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from pydantic_core import to_jsonable_python

from contract.parameter_ranges import require_plausible
from spinewatch.errors import ParameterError
from spinewatch.parameters import Parameters

DEFAULTS: dict[str, Any] = to_jsonable_python(Parameters())


def numbers(values: Mapping[str, Any], *path: str) -> Iterator[tuple[tuple[str, ...], float]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from numbers(value, *path, name)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield (*path, name), value


def nested(path: tuple[str, ...], value: Any) -> dict[str, Any]:
    for name in reversed(path):
        value = {name: value}
    document: dict[str, Any] = value
    return document


def problem(path: str, value: Any) -> str | None:
    try:
        require_plausible(nested(tuple(path.split(".")), value), DEFAULTS)
    except ParameterError as error:
        return str(error)
    return None


def test_every_default_and_values_around_it_are_admitted() -> None:
    require_plausible(DEFAULTS, DEFAULTS)
    for path, default in numbers(DEFAULTS):
        for value in (default, default * 2 if default >= 1 or default < 0 else default / 2):
            require_plausible(nested(path, value), DEFAULTS)


def test_numbers_that_cannot_be_right_are_refused_for_every_parameter() -> None:
    for path, default in numbers(DEFAULTS):
        for value in (-default, default * 1e9, 10**400, float("inf"), float("nan"), True, "1", [default]):
            with pytest.raises(ParameterError, match=path[-1]):
                require_plausible(nested(path, value), DEFAULTS)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("second_look.rounds", 0),
        ("detection.max_features", 400.0),
        ("detection.scales", [0.97, 1.0, 1.03]),
        ("search.selection.chain.gap_ratios", [[1.0, 0.9], [2.0, 0.1]]),
        ("detection.comparisons", [{"space": "intensity", "measure": "CCN", "weight": 0.5}]),
        ("search.matching.epipolar.range_mm", [500.0, 900.0]),
        ("search.matching.epipolar.range_mm", None),
        ("search.occlusion.enabled", False),
        ("of_a_later_version", -1),
    ],
)
def test_sensible_changes_are_admitted(path: str, value: Any) -> None:
    assert problem(path, value) is None


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("detection.quality.n_strips", 0),
        ("detection.quality.n_strips", 1_000_000),
        ("detection.quality.n_strips", 6.5),
        ("rig_check.max_p_value", 0),
        ("rig_check.max_p_value", 1.5),
        ("search.matching.epipolar.range_fractions", [0, 0]),
        ("detection.scales", []),
        ("detection.scales", [1.0] * 51),
        ("detection.scales", 1.0),
        ("detection.comparisons", [0]),
        ("detection.comparisons", [{"space": "intensity"}]),
        ("search.occlusion.enabled", 1),
    ],
)
def test_changes_that_cannot_be_right_are_refused(path: str, value: Any) -> None:
    assert path in (problem(path, value) or "")


def test_the_error_names_the_range() -> None:
    assert problem("detection.sigma_px", [0.1, -1]) == (
        "the parameter detection.sigma_px must be a list of 1 to 50 items, each a number from 0.00015 to 150; it is"
        " [0.15, 0.15] by default"
    )
    assert "must be true or false" in (problem("search.occlusion.enabled", 1) or "")
