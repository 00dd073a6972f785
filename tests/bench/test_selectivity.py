"""The selectivity study: the background patches, and properties of its tables on the sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench import selectivity
from bench.balls import find_ball_scenes
from bench.selectivity import PATCH, background, measure
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.candidates.templates import HALF
from tests.paths import SAMPLES


@given(st.lists(st.tuples(st.floats(0, 567), st.floats(0, 415)), max_size=20))
def test_background_lies_in_the_field_away_from_balls(balls: list[tuple[float, float]]) -> None:
    field = SurgicalField(13, 40, 460, 331)
    centres = np.array(balls).reshape(-1, 2)
    for u, v in background(field, centres):
        assert field.u0 <= u <= field.u1 - PATCH
        assert field.v0 <= v <= field.v1 - PATCH
        gap = np.maximum(np.array([u, v]) - centres, centres - np.array([u, v]) - PATCH + 1)
        assert (gap.max(axis=1) > HALF - 1).all()


def test_a_field_without_balls_is_all_background() -> None:
    assert len(background(SurgicalField(0, 0, 200, 149), np.empty((0, 2)))) == 4 * 2


def test_the_coefficient_is_the_most_selective_on_gray_levels_and_edges_as_published() -> None:
    responses = measure(list(find_ball_scenes(SAMPLES)))
    for space in (PropertySpace.GRAY, PropertySpace.EDGE):
        means = {m: np.mean([r.selectivity for r in responses[space, m]]) for m in Measure}
        assert max(means, key=means.__getitem__) is Measure.RHO
    assert all(len(values) == 6 for values in responses.values())


def test_every_table_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert selectivity.main([str(SAMPLES)]) == 0
    printed = capsys.readouterr().out
    for title in (
        "Table 4.1",
        "Ranking",
        "Table 4.2: left",
        "Table 4.3: right",
        "right directivity templates",
    ):
        assert title in printed


def test_one_scene_is_not_enough(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as stop:
        selectivity.main([str(tmp_path)])
    assert stop.value.code == 2
