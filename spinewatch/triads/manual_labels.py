"""Labels that a person gave to triads, compared with the order of the vertebrae and the distances between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.levels import vertebra_names
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.labels import LabelledTriad, spacing_problem
from spinewatch.triads.spine_order import axis_number, axis_problem

LEVELS_IMPLAUSIBLE = "levels-implausible"
"""Code of the flag of labels that the order of the triads or the distances between them contradict."""


def manual_label_flags(
    triads: Sequence[LabelledTriad],
    labels: Sequence[str],
    axis: SpineAxis = "auto",
    parameters: LabelParameters | None = None,
    known: KnownConfiguration | None = None,
    extra_levels: Sequence[str] = (),
) -> tuple[Flag, ...]:
    """Return a flag of labels that contradict the places of their triads.

    Labels that are found follow the order along the spine axis; those of a person may not. Triads that do not lie along
    the axis have no order along it, so that only their distances are compared.

    Parameters
    ----------
    triads
        Triads with their labels, in any order; those without a label do not count.
    labels
        Vertebrae in order of increasing coordinate along the axis, in anatomical order.
    axis
        Object axis along which the spine extends; "auto" is that of greatest extent.
    parameters
        Limits; the default ones if None.
    known
        Known configuration, if any; distances that fit it are plausible.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.

    Returns
    -------
    tuple of Flag
        "levels-implausible", or none.

    Raises
    ------
    LevelError
        If the labels are not names of vertebrae in order.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.triads.pose import MeasuredTriad, Pose
    >>> at = lambda x: MeasuredTriad("flat", {}, Pose(np.array([x, 0, 0]), np.eye(3), np.zeros((6, 6))), 0.0)
    >>> given = zip(("L1", "T9", "T11"), (0.0, 52.0, 104.0), strict=True)
    >>> [flag.code for flag in manual_label_flags(
    ...     [LabelledTriad(name, None, at(x)) for name, x in given], ["L1", "T11", "T9"])]
    ['levels-implausible']
    """
    p, known = parameters or LabelParameters(), known or KnownConfiguration()
    names = vertebra_names(labels, extra_levels)
    placed = {triad.label: triad.triad for triad in triads}
    assignment = tuple(k for k, name in enumerate(names) if name in placed)
    if len(assignment) < 2:
        return ()
    named = [names[k] for k in assignment]
    ordered = [placed[name] for name in named]
    problem = _order_problem(named, np.array([triad.position_mm for triad in ordered]), axis, p)
    problem = problem or spacing_problem(assignment, ordered, names, extra_levels, p, known)
    return (Flag(LEVELS_IMPLAUSIBLE, problem),) if problem else ()


def _order_problem(
    names: Sequence[str], positions_mm: Float, axis: SpineAxis, p: LabelParameters
) -> str | None:
    """Return how the order of vertebrae (n,) at positions (n, 3) along the axis contradicts their names, or None."""
    if axis_problem(positions_mm, axis, p.max_axis_angle_deg, p.min_axis_margin_deg):
        return None
    k = axis_number(positions_mm, axis)
    along = positions_mm[:, k]
    if not (np.diff(along) < 0).any():
        return None
    seen = [names[i] for i in np.argsort(along, kind="stable")]
    advice = "look which end is cranial" if seen == list(names)[::-1] else "look whether two were exchanged"
    return (
        f"the labels in order along {'xy'[k]} are {', '.join(seen)}, and the vertebrae of the surgery"
        f" {', '.join(names)}; {advice}, and correct the labels"
    )
