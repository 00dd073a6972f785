"""By how much a candidate triad beside the chosen chain would add to the chain's log-odds."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.matching.chain import ChainCandidates, step_log_odds
from spinewatch.matching.points import Points
from spinewatch.matching.selection import (
    SelectionParameters,
    SpineAxis,
    TriadCandidates,
    chance_volume_mm3,
)


def insertion_gains(
    members: TriadCandidates,
    others: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    axis: SpineAxis = "auto",
) -> Float:
    """Return what each candidate would add to the log-odds of a chain, in its place along the spine.

    Parameters
    ----------
    members
        k members of the chain.
    others
        c candidates that no member excludes.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge of the chain.
    axis
        Object axis along which the spine extends; "auto" for the one along which the chain is likelier.

    Returns
    -------
    Float
        Difference of the log-odds with and without the candidate, shape (c,); minus infinity where the chain has no
        place for it.
    """
    gains = others.log_odds - parameters.chain.min_log_odds
    if not len(members) or not len(others):
        return np.asarray(gains)
    k, chain = len(members), parameters.chain
    everything = TriadCandidates.concatenate([members, others])
    free = np.zeros((len(everything), len(everything)), dtype=bool)
    candidates = ChainCandidates(everything.origin_mm, everything.log_odds, free)
    spacings = np.geomspace(*chain.spacing_mm, chain.n_spacings)
    volume = chance_volume_mm3(points, parameters)
    best = (-np.inf, np.full(len(others), -np.inf))
    for a in (0, 1) if axis == "auto" else ("xy".index(axis),):
        steps = step_log_odds(candidates, a, volume, spacings, chain)
        order = np.argsort(everything.origin_mm[:k, a], kind="stable")
        place = np.searchsorted(everything.origin_mm[order, a], everything.origin_mm[k:, a])
        base, inserted = _chain_values(steps, order, place, k)
        if base.max() > best[0]:
            best = float(base.max()), inserted.max(axis=0) - base.max()
    return np.asarray(best[1] + gains)


def _chain_values(steps: Float, order: Int, place: Int, k: int) -> tuple[Float, Float]:
    """Return the sums of the steps (s,) of a chain, and those (s, c) with each candidate in its place."""
    links = steps[:, order[:-1], order[1:]]
    possible = np.isfinite(links).all(axis=1)
    base = np.where(possible, links.sum(axis=1), -np.inf)
    other = k + np.arange(len(place))
    inserted = np.tile(base[:, None], (1, len(place)))
    before, after = place > 0, place < k
    inserted[:, before] += steps[:, order[place[before] - 1], other[before]]
    inserted[:, after] += steps[:, other[after], order[place[after]]]
    between = before & after
    replaced = links[:, place[between] - 1]
    inserted[:, between] -= np.where(np.isfinite(replaced), replaced, 0.0)
    return base, inserted
