from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Pixels
from spinewatch.calibration.marks.detection import TargetParameters, find_targets
from tests.spinewatch.calibration.simulated import FIELD, IDENTITY, TABLE_3_3

Boards = dict[str, tuple[tuple[Pixels, Pixels], Any]]
V, U = np.indices((160, 200))


def disc_on_top(centre: tuple[float, float], radius: float = 6.0, noise: float = 0.0) -> Pixels:
    """A dark disc on a white one on gray, drawn with a blurred edge."""
    r = np.hypot(U - centre[0], V - centre[1])
    dark, white = (1 / (1 + np.exp((r - edge) / 0.4)) for edge in (radius, 2 * radius))
    image = 110 + 130 * white - 210 * dark + noise * np.random.default_rng(0).standard_normal(r.shape)
    return np.asarray(np.clip(np.round(image), 0, 255), dtype=np.uint8)


@given(st.floats(60, 140), st.floats(60, 100), st.floats(4, 7.5))
@settings(max_examples=25, deadline=None)
def test_a_disc_is_centred_to_a_few_hundredths_of_a_pixel(u: float, v: float, radius: float) -> None:
    targets = find_targets(disc_on_top((u, v), radius))
    assert np.abs(targets.pixels - (u, v)).max() < 0.03
    assert targets.variance_px2 == pytest.approx([radius**2 / 4], rel=0.1)
    assert targets.contrast == pytest.approx([210], abs=25)


def test_noise_increases_the_stated_deviation_and_not_below_the_actual_error() -> None:
    quiet, noisy = (find_targets(disc_on_top((80.3, 80.7), noise=n)) for n in (0.0, 12.0))
    assert TargetParameters().min_sd_px <= quiet.sd_px[0] < 0.04
    assert noisy.sd_px[0] > 1.5 * quiet.sd_px[0]
    assert np.abs(noisy.pixels[0] - (80.3, 80.7)).max() < 4 * noisy.sd_px[0]


@pytest.mark.parametrize("image", [np.full((100, 120), 90), disc_on_top((3.0, 80.0)), V])
def test_no_target_is_found_where_there_is_none_or_where_the_border_cuts_it(image: Any) -> None:
    assert len(find_targets(image.astype(np.uint8))) == 0


def test_thresholds_are_those_of_the_parameters() -> None:
    image = disc_on_top((80.0, 80.0))
    parameters = TargetParameters()
    assert len(find_targets(image, parameters)) == 1
    for stricter in (
        replace(parameters, min_contrast=0.99),
        replace(parameters, min_levels=17),
        replace(parameters, min_width_px=20.0),
        replace(parameters, max_area_fraction=0.001),
    ):
        assert len(find_targets(image, stricter)) == 0


@pytest.mark.parametrize("trial", ["C", "A"])
@pytest.mark.parametrize("side", [0, 1])
def test_all_visible_pegs_of_rendered_boards_are_found(
    boards: Boards, trial: str, side: Literal[0, 1]
) -> None:
    images, truth = boards[trial]
    targets = find_targets(images[side])
    assert np.all(np.diff(targets.contrast) <= 0)
    for id_ in truth["visible_both"]:
        true = truth["points"][id_][("left", "right")[side]]["center_px"]
        assert np.linalg.norm(targets.pixels - true, axis=1).min() < 0.15, id_


def test_targets_are_where_the_rig_projects_them(boards: Boards) -> None:
    projected = TABLE_3_3.left.project(IDENTITY(FIELD.points_mm))
    targets = find_targets(boards["C"][0][0])
    distance = np.linalg.norm(targets.pixels[:, None] - projected[None], axis=2).min(axis=1)
    assert np.median(distance) < 40
