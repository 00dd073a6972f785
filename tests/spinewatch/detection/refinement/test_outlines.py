"""The outline of a sphere in perspective, traced."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.refinement.outlines import outline_offsets
from spinewatch.simulation.rigs import table_3_3_rig


@given(st.floats(0, 567), st.floats(0, 415), st.floats(300, 900))
def test_the_centre_of_an_outline_is_corrected_to_that_of_the_ball(
    u: float, v: float, range_mm: float
) -> None:
    camera = table_3_3_rig().left
    centre = camera.centre + range_mm * camera.directions(np.array([[u, v]]))[0]
    # The rim where rays touch a ball; 40 mm wide, so that the effect is large.
    radius = 20.0
    toward = camera.centre - centre
    distance = np.linalg.norm(toward)
    toward = toward / distance
    side = np.linalg.svd(toward[None])[2][1:]
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    sine = radius / distance
    rim = centre + radius * (
        sine * toward
        + np.sqrt(1 - sine**2) * (np.cos(angle)[:, None] * side[0] + np.sin(angle)[:, None] * side[1])
    )
    plain = replace(camera, radial=(0.0, 0.0), decentering=(0.0, 0.0))
    outline = plain.project(rim)
    a, b = outline, np.roll(outline, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    area_centre = ((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
    true = plain.project(centre)
    width = 2 * radius * plain.focal_length_mm / np.sqrt(distance**2 - radius**2) / plain.pixel_size_mm[0]
    offset = outline_offsets(plain, area_centre[None], width)[0]
    assert offset == pytest.approx(area_centre - true, abs=0.02)
