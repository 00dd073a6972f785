"""Common points that fit a mirrored view are named, alone or beside the view that was given."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.spine.radiographs import initial_from_radiographs
from tests.spinewatch.spine.radiograph_scenes import LATERAL, OBJECT, PA, scene, seen

CODE = "radiograph-mirror-possible"
WIDTH_PX = 2200.0


def details(count: int, mirrored: bool = False, stated: bool = False, seed: int = 3) -> list[str]:
    """Return the details of the flag with some of the eight common points, the PA view mirrored or not."""
    shown = seen(scene(seed), 1.0, seed)
    vertebrae, common = list(shown.vertebrae), list(shown.common[:count])
    if mirrored:
        sign, shift = np.array([-1.0, 1.0]), np.array([WIDTH_PX, 0.0])
        # what is on the left of a mirrored image is named left
        vertebrae = [
            dataclasses.replace(
                v,
                pa_px=(v.pa_px * sign + shift)[[1, 0, 3, 2]],
                pedicles_px=None if v.pedicles_px is None else (v.pedicles_px * sign + shift)[[1, 0]],
            )
            for v in vertebrae
        ]
        common = [dataclasses.replace(c, pa_px=c.pa_px * sign + shift) for c in common]
    axes = OBJECT.rotation if stated else None
    _, fit = initial_from_radiographs(PA, LATERAL, vertebrae, common, 1.0, patient_axes=axes)
    return [flag.detail for flag in fit.flags if flag.code == CODE]


@pytest.mark.parametrize("mirrored", [False, True])
def test_three_points_show_no_mirrored_view_and_that_is_said(mirrored: bool) -> None:
    (detail,) = details(3, mirrored)
    assert "the 3 common points fit a mirrored PA or lateral view as well" in detail


@pytest.mark.parametrize("count", [4, 8])
def test_points_in_space_exclude_a_mirrored_view(count: int) -> None:
    assert details(count) == []


def test_a_mirrored_view_that_points_in_space_show_is_named() -> None:
    (detail,) = details(4, mirrored=True)
    assert "and not the one that was given" in detail


def test_stated_patient_axes_decide_for_three_points() -> None:
    assert details(3, stated=True) == []
    with pytest.raises(PatientAxesContradictedError):
        details(3, mirrored=True, stated=True)
