from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.vertebra_measures import VERTEBRA_MEASURES, vertebra_measures
from tests.spinewatch.spine.spines import errors, tilted


def test_tilts_and_displacement_of_each_vertebra() -> None:
    spine = tilted([0.0, 20.0, -10.0], [5.0, 0.0, -5.0], [0.0, 7.0, -3.0])
    spine = replace(spine, errors={"triads A": errors(3, 0.4, 1.0)})
    found = vertebra_measures(spine)
    assert [(m.levels, m.definition) for m in found] == [
        ((level,), definition) for level in ("L3", "L4", "L5") for definition in VERTEBRA_MEASURES
    ]
    values = np.array([m.value for m in found]).reshape(3, 4)
    assert values[:, :3] == pytest.approx(np.array([[0, 5, 0], [20, 0, 7], [-10, -5, -3]]))
    assert values[:, 3] == pytest.approx(-spine.poses.position_mm[:, 1])
    assert found[3].sd == pytest.approx(0.4)
    assert found[4].sd == pytest.approx(1.0)


def test_a_vertebra_without_a_pose_has_a_reason() -> None:
    spine = tilted([0.0, 20.0, -10.0])
    position = spine.poses.position_mm.copy()
    position[0] = np.nan
    found = vertebra_measures(replace(spine, poses=SpinePoses(position, spine.poses.rotation)))
    assert [m.status for m in found[:4]] == [MeasureStatus.MEASURED] * 3 + [MeasureStatus.NOT_MEASURED]
    assert found[3].reason == "L3 was not measured: it has no pose"
