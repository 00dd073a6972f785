"""The plan of a rig and a marker: everything that is expected of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.markers import TriadModel
from spinewatch.planning.accuracy import ExpectedAccuracy, expected_accuracy, straight_chain
from spinewatch.planning.depth_range import DepthAccuracy, accuracy_over_depth, pixel_mm
from spinewatch.planning.marker_ambiguity import MarkerAmbiguity, marker_ambiguity
from spinewatch.simulation.rigs import convergence_point

_NEAREST = 0.5
"""Smallest height of the cameras above a triad, of that above the point in which the axes meet."""


@dataclass(frozen=True)
class PlanParameters:
    """Where the triads are, and how well their balls are measured.

    Attributes
    ----------
    vertebrae
        Vertebrae with a triad, the reference first.
    spacing_mm
        Distance between neighbours, mm.
    spine_axis
        Object axis along the spine: 0 for X, 1 for Y.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, mrad, as in poses.
    heights_mm
        Heights above the point in which the optical axes meet, mm, at which one triad is planned too.
    """

    vertebrae: tuple[str, ...] = ("L1", "T11", "T9", "T7")
    spacing_mm: float = 50.0
    spine_axis: int = 0
    sigma_px: float = 0.1
    common_sd_mrad: float = 0.12
    heights_mm: tuple[float, ...] = (-60.0, -30.0, 0.0, 30.0, 60.0)


@dataclass(frozen=True, eq=False)
class Plan:
    """What is expected of a rig and a marker.

    Attributes
    ----------
    accuracy
        Standard deviations of a chain of triads in the middle of the field of view.
    depths
        Those of one triad at several heights.
    ambiguity
        How well the balls are told apart; None for a marker of four balls.
    height_mm
        Height of the cameras above the point in which their optical axes meet, mean of both, mm.
    pixel_mm
        Width of a pixel at that point, mm.
    """

    accuracy: ExpectedAccuracy
    depths: tuple[DepthAccuracy, ...]
    ambiguity: MarkerAmbiguity | None
    height_mm: float
    pixel_mm: float


def make_plan(rig: Rig, model: TriadModel, parameters: PlanParameters | None = None) -> Plan:
    """Return what is expected of a rig and a marker.

    Parameters
    ----------
    rig
        The cameras.
    model
        The marker.
    parameters
        The triads, by default `PlanParameters`.

    Returns
    -------
    Plan
        Accuracy, accuracy over the depth, and ambiguity.

    Raises
    ------
    ParameterError
        If the optical axes are parallel, or a height is too near to the cameras.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.planning.planned_rig import planned_rig
    >>> plan = make_plan(planned_rig(), FLAT_10_14_18)
    >>> round(plan.height_mm), len(plan.depths)
    (736, 5)
    """
    p = parameters or PlanParameters()
    middle = convergence_point(rig)
    height = _height_mm(rig, middle)
    if any(h > _NEAREST * height for h in p.heights_mm):
        raise ParameterError(
            f"a height of {max(p.heights_mm):g} mm is more than half of the way up to the cameras at {height:.0f} mm;"
            " plan a smaller range of depth"
        )
    chain = straight_chain(p.vertebrae, middle, p.spacing_mm, p.spine_axis)
    centre = straight_chain(p.vertebrae[:1], middle, p.spacing_mm, p.spine_axis)[0]
    noise = p.sigma_px, p.common_sd_mrad
    return Plan(
        accuracy=expected_accuracy(rig, model, p.vertebrae, chain, *noise),
        depths=accuracy_over_depth(rig, model, centre, p.heights_mm, *noise),
        ambiguity=marker_ambiguity(rig, model, chain, p.sigma_px) if len(model.balls) == 3 else None,
        height_mm=height,
        pixel_mm=pixel_mm(rig, middle),
    )


def planned_heights(depth_mm: tuple[float, float], planes: int) -> tuple[float, ...]:
    """Return evenly spaced heights.

    Parameters
    ----------
    depth_mm
        Lowest and highest, mm.
    planes
        Number of heights, ends included.

    Returns
    -------
    tuple of float
        The heights, lowest first, mm.

    Raises
    ------
    ParameterError
        If the lowest is not below the highest.

    Examples
    --------
    >>> planned_heights((-60.0, 60.0), 3)
    (-60.0, 0.0, 60.0)
    """
    if not depth_mm[0] < depth_mm[1]:
        raise ParameterError("the lowest height is not below the highest one; exchange them")
    return tuple(np.linspace(*depth_mm, planes).tolist())


def _height_mm(rig: Rig, middle_mm: Float) -> float:
    centres: Sequence[Float] = (rig.left.centre, rig.right.centre)
    return float(np.mean([centre[2] - middle_mm[2] for centre in centres]))
