import numpy as np
import pytest

from spinewatch.errors import RigError
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.simulation.rigs import convergence_point


def test_axes_meet_at_the_origin_below_cameras_of_the_given_height() -> None:
    rig = planned_rig(500.0, 900.0, 12.0, (1280, 960), (0.005, 0.0048))
    assert np.allclose(convergence_point(rig), 0, atol=1e-9)
    assert [camera.centre[2] for camera in (rig.left, rig.right)] == [900.0, 900.0]
    assert rig.baseline_mm == pytest.approx(500)
    assert rig.left.image_size_px == (1280, 960)
    assert rig.left.focal_length_mm == rig.right.focal_length_mm == 12.0


def test_a_rig_that_cannot_be_built_is_refused() -> None:
    with pytest.raises(RigError, match="baseline"):
        planned_rig(baseline_mm=10.0)
