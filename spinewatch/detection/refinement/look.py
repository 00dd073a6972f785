"""Whether the balls of a pair look as usual: then the small network of usual looks is accurate enough.

Networks of different training tell an unusual look by what they take for a ball and by how certain they are. The
distance of their centres over the stated deviations does not tell it: they state larger deviations where they disagree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float


@dataclass(frozen=True)
class LookParameters:
    """Limits of a usual look. On simulated balls 97% and 0.03 are usual; matte, smeared and dim ones are beyond them.

    Attributes
    ----------
    min_odds
        Least odds of a ball with which a network does not rule one out.
    min_balls
        Least number of balls of both views that both networks see; with fewer nothing is known of their look.
    min_agreement
        Least fraction of the balls that one network or the other sees which both see.
    max_sd
        Largest median deviation of the centres of these per axis, radii of the ball.
    """

    min_odds: float = 0.3
    min_balls: int = 8
    min_agreement: float = 0.85
    max_sd: float = 0.03


@dataclass(frozen=True, eq=False)
class Look:
    """What two networks of different training see at n places of one view.

    Attributes
    ----------
    first, second
        Whether each of them sees a ball, shape (n,).
    sd
        Standard deviation per axis that they state of its centre, radii, shape (n,).
    """

    first: Bool
    second: Bool
    sd: Float


def is_usual(views: Sequence[Look], parameters: LookParameters) -> bool:
    """Return whether the balls of all views look as usual.

    Parameters
    ----------
    views
        What the networks see in each view.
    parameters
        Limits.

    Returns
    -------
    bool
        Whether the networks agree on what is a ball and are certain of the centres.

    Examples
    --------
    >>> yes, no = np.ones(20, bool), np.zeros(20, bool)
    >>> [is_usual([Look(yes, second, np.full(20, 0.02))], LookParameters()) for second in (yes, no)]
    [True, False]
    """
    p = parameters
    first, second, sd = (
        np.concatenate([getattr(view, name) for view in views]) for name in ("first", "second", "sd")
    )
    seen = first & second
    if seen.sum() < p.min_balls:
        return False
    return bool(seen.sum() >= p.min_agreement * (first | second).sum() and np.median(sd[seen]) <= p.max_sd)
