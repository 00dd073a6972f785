"""Other texts that a person may have meant by the description of a marker, and markers that look the same."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.markers import FLAT_10_14_18, KINDS, TriadModel, parse_marker

_SAME_MM = 1.0
"""Distances of two markers that differ by less do not tell them apart."""

_FACTORS = (2.0, 0.5, 10.0, 0.1, 25.4, 1 / 25.4)
"""Lengths given as halves or doubles, in cm or tenths of a mm, or in inches."""


def other_markers(model: TriadModel) -> tuple[tuple[str, TriadModel], ...]:
    """Return the markers that may have been meant by another order or unit of the lengths.

    Parameters
    ----------
    model
        A marker with three legs, as `parse_marker` returns it.

    Returns
    -------
    tuple of (str, TriadModel)
        Text and marker: the same lengths in the other orders, other units, the other kind, and the marker of the
        thesis. None for other markers.

    Examples
    --------
    >>> [text for text, _ in other_markers(parse_marker("flat:10,14,18"))][:3]
    ['flat:10,18,14', 'flat:14,10,18', 'flat:14,18,10']
    """
    description = _description(model)
    if description is None:
        return ()
    kind, legs = description
    orders, units = sorted(permutations(legs)), [tuple(factor * leg for leg in legs) for factor in _FACTORS]
    described = [(kind, each) for each in (*orders, *units)]
    described += [(other, each) for other in KINDS if other != kind for each in orders]
    texts = [f"{name}:{','.join(f'{leg:.4g}' for leg in each)}" for name, each in described]
    found: list[tuple[str, TriadModel]] = []
    for text in (*texts, FLAT_10_14_18.name):
        try:
            other = parse_marker(text)
        except ParameterError:
            continue
        if not any(
            np.allclose(other.coordinates_mm, one.coordinates_mm) for one in (model, *(m for _, m in found))
        ):
            found.append((text, other))
    return tuple(found)


def require_possible(models: Sequence[TriadModel]) -> None:
    """Raise unless the balls of each marker have room, and any two markers that face the cameras can be told apart.

    Parameters
    ----------
    models
        Markers in use; one that is given twice counts once.

    Raises
    ------
    ParameterError
        If balls overlap, or if two markers have the same distances with other names of the balls.

    Examples
    --------
    >>> require_possible([parse_marker("flat:18,14,10"), parse_marker("flat:10,14,18")])
    >>> require_possible([parse_marker("orthogonal:30,22,16"), parse_marker("orthogonal:22,16,30")])
    Traceback (most recent call last):
    spinewatch.errors.ParameterError: markers orthogonal-30-22-16 and orthogonal-22-16-30 cannot be told apart; ...
    """
    for index, model in enumerate(models):
        if model.distances_mm.min() < model.ball_diameter_mm:
            raise ParameterError(
                f"the balls of marker {model.name} would overlap: two are {model.distances_mm.min():.1f} mm apart and"
                f" {model.ball_diameter_mm:g} mm wide; give the lengths of its legs in mm, from P to the centre of a"
                " ball"
            )
        for other in models[:index]:
            if _look_the_same(other, model):
                raise ParameterError(
                    f"markers {other.name} and {model.name} cannot be told apart; give each kind once, with its lengths"
                    " in the order of its balls"
                )


def _look_the_same(one: TriadModel, other: TriadModel) -> bool:
    """Return whether another order of the balls has the same distances, and the same sense of rotation about z."""
    n = len(one.balls)
    if n != len(other.balls) or np.allclose(one.coordinates_mm, other.coordinates_mm):
        return False
    for order in permutations(range(n)):
        balls = other.coordinates_mm[list(order)]
        a, b = balls[one.pairs.T]
        if np.abs(np.linalg.norm(a - b, axis=1) - one.distances_mm).max() >= _SAME_MM:
            continue
        if n > 3 or _sense(balls) == _sense(one.coordinates_mm):
            return True
    return False


def _sense(balls_mm: Float) -> float:
    a, b, c = balls_mm
    return float(np.sign(np.cross(b - a, c - a)[2]))


def _description(model: TriadModel) -> tuple[str, tuple[float, ...]] | None:
    """Return kind and legs, mm, of a marker that `parse_marker` makes; None of another one."""
    legs = tuple(float(f"{leg:.6g}") for leg in np.linalg.norm(model.coordinates_mm, axis=1))
    if len(legs) != 3:
        return None
    for kind, make in KINDS.items():
        if np.allclose(make(*legs).coordinates_mm, model.coordinates_mm):
            return kind, legs
    return None
