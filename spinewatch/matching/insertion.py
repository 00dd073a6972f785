"""By how much a candidate triad beside the chosen chain, or a member of it, adds to the chain's log-odds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.matching.chain import ChainCandidates, step_log_odds
from spinewatch.matching.points import Points
from spinewatch.matching.selection import chance_volume_mm3
from spinewatch.matching.selection_parameters import SelectionParameters, SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates


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
    k = len(members)
    everything = TriadCandidates.concatenate([members, others])
    best = (-np.inf, np.full(len(others), -np.inf))
    for steps, along in _steps(everything, points, parameters, axis):
        order = np.argsort(along[:k], kind="stable")
        place = np.searchsorted(along[order], along[k:])
        base, inserted = _chain_values(steps, order, place, k)
        if base.max() > best[0]:
            best = float(base.max()), inserted.max(axis=0) - base.max()
    return np.asarray(best[1] + gains)


def member_gains(
    members: TriadCandidates, points: Points, parameters: SelectionParameters, axis: SpineAxis = "auto"
) -> Float:
    """Return what each member of a chain adds to the log-odds of the chain of the others.

    Parameters
    ----------
    members
        k members of the chain.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge of the chain.
    axis
        Object axis along which the spine extends; "auto" for the one along which the chain of the others is likelier.

    Returns
    -------
    Float
        The `insertion_gains` of each member into the chain of the others, shape (k,).
    """
    gains = members.log_odds - parameters.chain.min_log_odds
    if len(members) < 2:
        return np.asarray(gains)
    best, best_gain = np.full((2, len(members)), -np.inf)
    for steps, along in _steps(members, points, parameters, axis):
        order = np.argsort(along, kind="stable")
        base, inserted = np.empty((2, len(members)))
        base[order], inserted[order] = (values.max(axis=0) for values in _values_without(steps, order))
        likelier = base > best
        best[likelier], best_gain[likelier] = base[likelier], inserted[likelier] - base[likelier]
    return np.asarray(best_gain + gains)


def _steps(
    candidates: TriadCandidates, points: Points, parameters: SelectionParameters, axis: SpineAxis
) -> Iterator[tuple[Float, Float]]:
    """Yield the log-odds (s, c, c) of steps between candidates and their coordinates (c,), for each possible axis."""
    free = np.zeros((len(candidates), len(candidates)), dtype=bool)
    chain = ChainCandidates(candidates.origin_mm, candidates.log_odds, free)
    volume = chance_volume_mm3(points, parameters)
    for a in (0, 1) if axis == "auto" else ("xy".index(axis),):
        yield step_log_odds(chain, a, volume, parameters.chain), candidates.origin_mm[:, a]


def _values_without(steps: Float, order: Int) -> tuple[Float, Float]:
    """Return the sums of the steps (s,) of a chain without each member in order (k,), and those with it inserted."""
    none = np.zeros((len(steps), 1))
    links = np.concatenate([none, steps[:, order[:-1], order[1:]], none], axis=1)
    bridge = np.concatenate([none, steps[:, order[:-2], order[2:]], none], axis=1)
    known_links, known_bridge = (np.where(np.isfinite(x), x, 0.0) for x in (links, bridge))
    broken = np.isneginf(links)
    others = broken.sum(axis=1, keepdims=True) - broken[:, :-1] - broken[:, 1:]
    sums = known_links.sum(axis=1, keepdims=True) - known_links[:, :-1] - known_links[:, 1:]
    base = np.where(others > 0, -np.inf, sums + bridge)
    return base, base + links[:, :-1] + links[:, 1:] - known_bridge


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
