from dataclasses import replace

import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.simulation.rigs import converging_rig, table_3_3_rig


def test_a_selection_of_rays_keeps_their_order() -> None:
    camera = table_3_3_rig().left
    rays = camera.rays(np.array([[100.0, 50.0], [200.0, 60.0], [300.0, 70.0]]), 0.01 * np.eye(2))
    some = rays.take([2, 0])
    assert len(some) == 2
    assert np.array_equal(some.vectors, rays.vectors[[2, 0]])


def test_optical_axes_approach_each_other_where_the_rig_was_aimed() -> None:
    rig = converging_rig(420, 32)
    aimed = np.linalg.norm(rig.left.centre - [434, 390, 90])
    assert rig.axes_approach_mm == pytest.approx((aimed, aimed))


def test_parallel_axes_approach_nowhere() -> None:
    rig = table_3_3_rig()
    assert (
        Rig("parallel", rig.left, replace(rig.right, rotation_deg=rig.left.rotation_deg)).axes_approach_mm
        is None
    )
