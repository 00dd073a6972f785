"""Marker design: the flat marker of three balls that a rig measures best within a given disc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.markers import TriadModel
from spinewatch.planning.accuracy import expected_covariances
from spinewatch.triads.pose import Pose


@dataclass(frozen=True)
class MarkerDesignParameters:
    """Constraints on the marker, and the steps of the search.

    Attributes
    ----------
    ball_diameter_mm
        Diameter of the balls, mm.
    min_difference_mm
        Minimum difference between two of the distances between balls, mm; it makes the balls distinguishable.
    min_distance_diameters
        Minimum distance between the centres of two balls, in ball diameters.
    coarse_step_deg
        Step of the first search over the angles between balls, degrees.
    fine_step_deg
        Step of the second search, within half a coarse step of the best angles of the first, degrees.
    """

    ball_diameter_mm: float = 8.0
    min_difference_mm: float = 4.0
    min_distance_diameters: float = 1.5
    coarse_step_deg: float = 10.0
    fine_step_deg: float = 2.0


def design_marker(
    rig: Rig,
    poses: Sequence[Pose],
    sigma_px: float,
    disc_radius_mm: float,
    parameters: MarkerDesignParameters | None = None,
) -> TriadModel:
    """Return the flat marker of three balls on the rim of a disc with the smallest expected rotation error.

    The error of a pose is the largest standard deviation about the triad's axes; markers are compared by its root
    mean square over the poses. Balls lie on the rim because moving one inwards only shortens distances. The centre
    of the disc is P.

    Parameters
    ----------
    rig
        The calibrated cameras.
    poses
        True poses to design the marker for.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    disc_radius_mm
        Distance of the balls' centres from P, mm.
    parameters
        Constraints and search steps.

    Returns
    -------
    TriadModel
        The best marker on the search grid.

    Raises
    ------
    ParameterError
        If no marker satisfies the constraints.

    References
    ----------
    Thesis section 7.2, Correspondence, recommendation 1: the positions of the balls as an optimization problem. There
    their distances are maximized, here the expected rotation error is minimized.

    Examples
    --------
    >>> from spinewatch.planning.accuracy import straight_chain
    >>> from spinewatch.simulation.rigs import convergence_point, large_rig
    >>> rig = large_rig()
    >>> poses = straight_chain(("L1",), convergence_point(rig), 50.0)
    >>> marker = design_marker(rig, poses, 0.1, 18.0, MarkerDesignParameters(coarse_step_deg=30.0))
    >>> sorted(marker.distances_mm.round(1).tolist())
    [21.4, 31.6, 35.6]
    """
    p = parameters or MarkerDesignParameters()
    half = p.coarse_step_deg / 2
    offsets = np.arange(-half, half + 1e-9, p.fine_step_deg).tolist()
    candidates = list(combinations(np.arange(p.coarse_step_deg, 360, p.coarse_step_deg).tolist(), 2))
    best = _best(rig, poses, sigma_px, _markers(candidates, disc_radius_mm, p))
    candidates = [(best[0] + a, best[1] + b) for a in offsets for b in offsets]
    markers = _markers(candidates, disc_radius_mm, p)
    return markers[_best(rig, poses, sigma_px, markers)]


_Angles = tuple[float, float]


def _best(rig: Rig, poses: Sequence[Pose], sigma_px: float, markers: dict[_Angles, TriadModel]) -> _Angles:
    """Return the angles of the marker with the smallest root mean square of the poses' largest rotation errors."""
    t, m = len(poses), len(markers)
    models = np.repeat([marker.coordinates_mm for marker in markers.values()], t, axis=0)
    P = np.tile([pose.position_mm for pose in poses], (m, 1))
    R = np.tile([pose.rotation for pose in poses], (m, 1, 1))
    about_object_axes = expected_covariances(rig, models, P, R, sigma_px)[:, 3:, 3:]
    variances = np.diagonal(np.swapaxes(R, -1, -2) @ about_object_axes @ R, axis1=1, axis2=2)
    errors = variances.max(axis=1).reshape(m, t).mean(axis=1)
    return list(markers)[int(np.argmin(errors))]


def _markers(
    candidates: Sequence[_Angles], radius_mm: float, p: MarkerDesignParameters
) -> dict[_Angles, TriadModel]:
    """Return the markers, by the angles of their second and third ball, that satisfy the constraints."""
    markers = {
        angles: marker for angles in candidates if (marker := _rim_marker(angles, radius_mm, p)) is not None
    }
    if not markers:
        raise ParameterError(
            f"no three balls with distances {p.min_difference_mm:g} mm apart fit a disc of radius"
            f" {radius_mm:g} mm; allow a larger disc or a smaller difference"
        )
    return markers


def _rim_marker(angles_deg: _Angles, radius_mm: float, p: MarkerDesignParameters) -> TriadModel | None:
    azimuth = np.radians([0.0, *angles_deg])
    rim = radius_mm * np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(3)])
    lengths = np.array([np.linalg.norm(rim[a] - rim[b]) for a, b in combinations(range(3), 2)])
    distinct = np.diff(np.sort(lengths)).min() >= p.min_difference_mm
    if not distinct or lengths.min() < p.min_distance_diameters * p.ball_diameter_mm:
        return None
    z = np.cross(rim[0] - rim[2], rim[0] - rim[1])[2]
    if z < 0:
        rim[:, 1] *= -1
    return TriadModel(f"disc-{radius_mm:g}", ("XX", "YY", "MX"), rim, p.ball_diameter_mm)
