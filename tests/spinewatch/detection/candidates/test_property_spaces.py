import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.candidates.property_spaces import PropertySpace, property_planes, sobel


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_the_gradient_of_a_ramp_is_its_slope(along_u: float, along_v: float) -> None:
    v, u = np.mgrid[:7, :9]
    ramp = (100 + along_u * u + along_v * v).astype(np.float32)
    assert sobel(ramp)[:, 3, 4] / 8 == pytest.approx([along_u, along_v], abs=1e-4)
    edge = property_planes(ramp, PropertySpace.EDGE)
    assert edge[0, 3, 4] / 8 == pytest.approx(np.hypot(along_u, along_v), abs=1e-4)


def test_spaces_have_one_plane_or_two() -> None:
    image = np.random.default_rng(0).uniform(0, 255, (6, 5)).astype(np.float32)
    planes = {space: len(property_planes(image, space)) for space in PropertySpace}
    assert planes == {PropertySpace.GRAY: 1, PropertySpace.EDGE: 1, PropertySpace.DIRECTIVITY: 2}
    assert np.array_equal(property_planes(image, PropertySpace.GRAY)[0], image)
    assert np.array_equal(property_planes(image, PropertySpace.DIRECTIVITY), sobel(image))
