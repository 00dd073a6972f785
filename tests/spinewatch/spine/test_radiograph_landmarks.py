"""What landmarks must fulfil."""

import dataclasses

import numpy as np
import pytest

from spinewatch.errors import ParameterError
from spinewatch.levels import LevelError
from spinewatch.spine.radiograph_landmarks import (
    LandmarkedVertebra,
    RadiographLandmarksError,
    RadiographView,
    in_anatomical_order,
    require_consistent,
)
from tests.spinewatch.spine.radiograph_scenes import LATERAL, PA, scene

VERTEBRAE = scene(0).vertebrae


def changed(index: int, **fields: np.ndarray | str | None) -> list[LandmarkedVertebra]:
    vertebrae = list(VERTEBRAE)
    vertebrae[index] = dataclasses.replace(vertebrae[index], **fields)  # type: ignore[arg-type]
    return vertebrae


def test_pixels_map_to_the_side_that_was_stated() -> None:
    points = np.array([[100.0, 40.0], [0.0, 0.0]])
    left = RadiographView((0.5, 0.25), "left").to_plane(points)
    right = RadiographView((0.5, 0.25), "right").to_plane(points)
    np.testing.assert_allclose(left, [[-25, -20], [0, 0]])
    np.testing.assert_allclose(right, [[25, -20], [0, 0]])


@pytest.mark.parametrize("spacing", [(0.0, 0.1), (0.1, -1.0), (0.1, np.nan), (np.inf, 0.1)])
def test_a_spacing_that_is_not_positive_is_refused(spacing: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="positive"):
        RadiographView(spacing, "left")


def test_sound_landmarks_pass_and_are_sorted() -> None:
    require_consistent(PA, LATERAL, VERTEBRAE)
    assert in_anatomical_order(VERTEBRAE[::-1]) == VERTEBRAE


def test_an_extra_level_is_sorted_between_its_neighbours() -> None:
    extra = dataclasses.replace(VERTEBRAE[0], level="T13")
    ordered = in_anatomical_order([VERTEBRAE[12], extra, VERTEBRAE[11]], ["T13"])
    assert [vertebra.level for vertebra in ordered] == ["T12", "T13", "L1"]
    with pytest.raises(LevelError):
        in_anatomical_order([extra])


def test_a_vertebra_given_twice_is_refused() -> None:
    with pytest.raises(RadiographLandmarksError, match="T5 are given twice"):
        in_anatomical_order(changed(3, level="T5"))


@pytest.mark.parametrize(
    ("index", "field", "order", "message"),
    [
        (2, "pa_px", [1, 0, 2, 3], "T3: left landmarks in the PA view"),
        (2, "lateral_px", [0, 1, 3, 2], "T3: anterior landmarks in the lateral view"),
        (16, "pa_px", [2, 3, 0, 1], "L5: superior landmarks in the PA view"),
        (16, "lateral_px", [2, 3, 0, 1], "L5: superior landmarks in the lateral view"),
        (4, "pedicles_px", [1, 0], "T5: the left pedicle"),
    ],
)
def test_exchanged_landmarks_are_named(index: int, field: str, order: list[int], message: str) -> None:
    wrong = changed(index, **{field: getattr(VERTEBRAE[index], field)[order]})
    with pytest.raises(RadiographLandmarksError, match=message):
        require_consistent(PA, LATERAL, wrong)


def test_the_wrong_side_of_a_whole_view_is_named_as_such() -> None:
    with pytest.raises(RadiographLandmarksError, match="correct left_on"):
        require_consistent(RadiographView((0.2, 0.18), "right"), LATERAL, VERTEBRAE)
    with pytest.raises(RadiographLandmarksError, match="correct anterior_on"):
        require_consistent(PA, RadiographView((0.2, 0.22), "left"), VERTEBRAE)


def test_a_view_upside_down_is_named_as_such() -> None:
    turned = [dataclasses.replace(v, pa_px=v.pa_px * [1, -1]) for v in VERTEBRAE]
    with pytest.raises(RadiographLandmarksError, match="turn the image"):
        require_consistent(PA, LATERAL, turned)


def test_vertebrae_with_exchanged_names_are_refused() -> None:
    wrong = [VERTEBRAE[0], dataclasses.replace(VERTEBRAE[2], level="T2")]
    wrong += [dataclasses.replace(VERTEBRAE[1], level="T3"), *VERTEBRAE[3:]]
    with pytest.raises(RadiographLandmarksError, match="T2: landmarks in the PA view lie below"):
        require_consistent(PA, LATERAL, wrong)
