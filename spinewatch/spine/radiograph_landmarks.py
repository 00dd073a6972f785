"""Landmarks that were digitized on a PA and a lateral radiograph, and what they must fulfil; NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.levels import level_numbers

Side = Literal["left", "right"]


class RadiographLandmarksError(SpinewatchError):
    """Landmarks of the radiographs contradict each other or cannot be used."""

    code = "radiograph-landmarks"


@dataclass(frozen=True)
class RadiographView:
    """How a radiograph maps to the patient; its upper edge is towards the head.

    Attributes
    ----------
    pixel_spacing_mm
        Distance of the rows and of the columns at the patient, mm.
    positive_on
        Side of the image on which the patient's left (PA view) or front (lateral view) lies.
    """

    pixel_spacing_mm: tuple[float, float]
    positive_on: Side

    def __post_init__(self) -> None:
        if not all(0 < spacing < np.inf for spacing in self.pixel_spacing_mm):
            raise ParameterError("pixel_spacing_mm must be two positive numbers, mm; correct them")

    def to_plane(self, points_px: Float) -> Float:
        """Return points in the plane of projection.

        Parameters
        ----------
        points_px
            Points (u, v), shape (..., 2), px.

        Returns
        -------
        Float
            Left (PA view) or anterior (lateral view) and cephalad coordinates, shape (..., 2), mm; the origin is the
            pixel (0, 0).

        Examples
        --------
        >>> RadiographView((0.5, 0.25), "left").to_plane(np.array([100.0, 40.0]))
        array([-25., -20.])
        """
        row, column = self.pixel_spacing_mm
        across = -column if self.positive_on == "left" else column
        return np.asarray(points_px * np.array([across, -row]))

    @property
    def pixel_mm(self) -> Float:
        """Size of a pixel across and along the spine, shape (2,), mm."""
        return np.array(self.pixel_spacing_mm[::-1])


@dataclass(frozen=True, eq=False)
class LandmarkedVertebra:
    """Landmarks of one vertebra, (u, v) in px. Sides are the patient's.

    Attributes
    ----------
    level
        Name of the vertebra.
    pa_px
        Corners of the body in the PA view: superior left, superior right, inferior left, inferior right, shape (4, 2).
        They are the ends of the end plates as the view shows them.
    lateral_px
        Corners in the lateral view: superior anterior, superior posterior, inferior anterior, inferior posterior, shape
        (4, 2).
    pedicles_px
        Centres of the left and the right pedicle in the PA view, shape (2, 2), or None.
    """

    level: str
    pa_px: Float
    lateral_px: Float
    pedicles_px: Float | None = None


@dataclass(frozen=True, eq=False)
class CommonPoint:
    """A point that both the radiographs and the cameras show.

    Attributes
    ----------
    name
        Its name.
    pa_px, lateral_px
        The point in both views (u, v), shape (2,), px.
    object_mm
        The point in object space, shape (3,), mm.
    covariance_mm2
        Covariance of that, shape (3, 3), mm^2.
    """

    name: str
    pa_px: Float
    lateral_px: Float
    object_mm: Float
    covariance_mm2: Float


def in_anatomical_order(
    vertebrae: Sequence[LandmarkedVertebra], extra_levels: Sequence[str] = ()
) -> tuple[LandmarkedVertebra, ...]:
    """Return vertebrae from cranial to caudal.

    Parameters
    ----------
    vertebrae
        Vertebrae in any order.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.

    Returns
    -------
    tuple of LandmarkedVertebra
        The same, sorted.

    Raises
    ------
    RadiographLandmarksError
        If a vertebra is given twice.
    LevelError
        If a name is not one of the sequence.
    """
    levels = [vertebra.level for vertebra in vertebrae]
    numbers = level_numbers(levels, extra_levels)
    for level in levels:
        if levels.count(level) > 1:
            raise RadiographLandmarksError(f"the landmarks of {level} are given twice; give them once")
    return tuple(vertebra for _, vertebra in sorted(zip(numbers, vertebrae, strict=True), key=lambda e: e[0]))


def require_consistent(
    pa: RadiographView, lateral: RadiographView, vertebrae: Sequence[LandmarkedVertebra]
) -> None:
    """Check that the landmarks of each vertebra lie as those of a vertebra do.

    Parameters
    ----------
    pa, lateral
        The views.
    vertebrae
        Vertebrae from cranial to caudal.

    Raises
    ------
    RadiographLandmarksError
        If left and right, front and back or upper and lower landmarks of a vertebra are exchanged, or a vertebra lies
        above one that is more cranial.
    """
    for view, name, side, points in (
        (pa, "PA", "left", [v.pa_px for v in vertebrae]),
        (lateral, "lateral", "anterior", [v.lateral_px for v in vertebrae]),
    ):
        plane = view.to_plane(np.stack(points))  # (n, 4, 2)
        exchanged: Bool = np.any(plane[:, 0::2, 0] <= plane[:, 1::2, 0], axis=1)
        if exchanged.all():
            raise RadiographLandmarksError(
                f"in the {name} view the {side} landmarks of every vertebra lie on the other side; correct {side}_on"
                " of the radiograph, or exchange the landmarks"
            )
        _refuse_any(exchanged, vertebrae, f"{side} landmarks in the {name} view lie on the other side")
        inverted: Bool = np.any(plane[:, :2, 1] <= plane[:, 2:, 1], axis=1)
        if inverted.all():
            raise RadiographLandmarksError(
                f"in the {name} view the superior landmarks of every vertebra lie below the inferior ones; turn the"
                " image so that the head is at its top"
            )
        _refuse_any(inverted, vertebrae, f"superior landmarks in the {name} view lie below the inferior ones")
        height = plane[..., 1].mean(axis=1)
        below: Bool = np.append(height[:-1] <= height[1:], False)
        _refuse_any(below, vertebrae, f"landmarks in the {name} view lie below those of the next vertebra")
    for vertebra in vertebrae:
        if vertebra.pedicles_px is not None:
            left, right = pa.to_plane(vertebra.pedicles_px)
            if left[0] <= right[0]:
                raise RadiographLandmarksError(
                    f"{vertebra.level}: the left pedicle lies right of the right one; exchange them"
                )


def _refuse_any(wrong: Bool, vertebrae: Sequence[LandmarkedVertebra], problem: str) -> None:
    """Raise an error that names the vertebrae of a mask (n,), if any."""
    names = ", ".join(v.level for v, bad in zip(vertebrae, wrong, strict=True) if bad)
    if names:
        raise RadiographLandmarksError(f"{names}: {problem}; correct the landmarks or the names")
