from __future__ import annotations

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.spine.assembly import assemble
from spinewatch.spine.bodies import INITIAL, StageMissingError
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.displacements import Base
from spinewatch.spine.interpolation_model import InterpolationParameters
from tests.spinewatch.spine.simulated import LEVELS, surgery

PARAMETERS = InterpolationParameters()


class Recorder:
    """Fills nothing in and keeps what it was given."""

    def __init__(self) -> None:
        self.calls: list[tuple[SpinePoses, Base, str]] = []

    def __call__(
        self,
        known: SpinePoses,
        errors: dict[str, Float],
        base: Base,
        source: str,
        parameters: InterpolationParameters,
    ) -> SpinePoses:
        self.calls.append((known, base, source))
        errors[source] = np.ones((8, 6, 1))
        return known


def test_the_baseline_is_the_initial_configuration_filled_in_absolutely() -> None:
    case, fill = surgery(1, ("T9", "L1")), Recorder()
    result = assemble(case.setup, case.stages, "PRE", fill, PARAMETERS)
    ((known, base, source),) = fill.calls
    assert source == "interpolation PRE"
    assert np.allclose(known.position_mm, case.truth["PRE"].position_mm)
    assert not base.poses.position_mm.any()
    assert np.array_equal(base.poses.rotation[3], np.eye(3))
    assert result.known is known
    assert set(result.errors) == {INITIAL, "interpolation PRE"}


def test_another_stage_starts_from_the_filled_baseline() -> None:
    case, fill = surgery(2, ("T9", "L1"), noise=1.0), Recorder()
    result = assemble(case.setup, case.stages, "POST", fill, PARAMETERS)
    (initial, _, first), (known, base, second) = fill.calls
    assert (first, second) == ("interpolation PRE", "interpolation POST")
    assert base.poses is initial
    assert set(base.errors) == {INITIAL, "interpolation PRE"}
    assert [name for name, p in zip(LEVELS, known.position_mm, strict=True) if np.isfinite(p).all()] == [
        "T9",
        "L1",
    ]
    assert set(result.errors) == {INITIAL, "triads PRE", "triads POST", "interpolation POST"}
    # The errors of the bodies themselves are left as they are.
    assert "interpolation POST" not in result.bodies.errors


def test_a_stage_that_is_not_given_is_named() -> None:
    case = surgery(3)
    with pytest.raises(StageMissingError, match="LATER"):
        assemble(case.setup, case.stages, "LATER", Recorder(), PARAMETERS)
