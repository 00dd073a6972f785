from dataclasses import FrozenInstanceError

import pytest

from spinewatch.calibration.solve.blunders import BlunderParameters
from spinewatch.calibration.solve.determinability import DeterminabilityParameters
from spinewatch.calibration.solve.dlt import DltParameters
from spinewatch.calibration.solve.initial_values import InitialValueParameters
from spinewatch.calibration.solve.parameters import SolveParameters


def test_the_parameters_of_all_steps_are_part_of_them_and_frozen() -> None:
    parameters = SolveParameters()
    assert parameters.dlt == DltParameters()
    assert parameters.initial_values == InitialValueParameters()
    assert parameters.determinability == DeterminabilityParameters()
    assert parameters.blunders == BlunderParameters()
    with pytest.raises(FrozenInstanceError):
        parameters.estimate_aspect = True  # type: ignore[misc]
