"""Selection of the triads: the most likely chain of candidates that do not exclude each other.

The thesis keeps the triplet of least error among rivals (`spinewatch.thesis_1995.heuristics`). Here every candidate has
log-odds (`spinewatch.matching.rating`), and the best chain of at most the expected number of candidates is selected. H1
to H3 hold therefore, H5 is the bound of the number, and H4 enters as a spacing that is regular but unknown.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Int
from spinewatch.matching.chain import ChainCandidates, best_chain
from spinewatch.matching.points import Points
from spinewatch.matching.selection_parameters import SelectionParameters, SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates, share_features


def select_triads(
    candidates: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the candidates of the most likely chain.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge and limits.
    expected
        Number of triads placed, which is never exceeded; None if it is not known.
    axis
        Object axis along which the spine extends; "auto" tries both and keeps the more likely chain.

    Returns
    -------
    Int
        Indices of the selected candidates in order along the axis, shape (k,).
    """
    if not len(candidates):
        return np.empty(0, dtype=np.intp)
    max_length = parameters.max_count if expected is None else expected
    chain = _chain_candidates(candidates, parameters)
    return _best_chain(chain, points, parameters, max_length, axis)[0]


def chain_log_odds(
    candidates: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> tuple[int, float]:
    """Return the length and the log-odds of the most likely chain.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge and limits.
    expected
        Number of triads placed, which is never exceeded; None if it is not known.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    length : int
        Number of members.
    log_odds : float
        Log-odds of the chain, 0 for an empty one.
    """
    if not len(candidates):
        return 0, 0.0
    max_length = parameters.max_count if expected is None else expected
    chain = _chain_candidates(candidates, parameters)
    members, log_odds = _best_chain(chain, points, parameters, max_length, axis)
    return len(members), log_odds


def surplus_triads(
    candidates: TriadCandidates,
    points: Points,
    selected: Int,
    parameters: SelectionParameters,
    *,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the most likely chain of the selected candidates and of others beside them, whatever number is expected.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    selected
        Indices of the selected candidates, shape (k,).
    parameters
        Prior knowledge and limits.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    Int
        Indices of the chain if it contains the selected candidates and each other member adds at least
        `SelectionParameters.surplus_log_odds`; otherwise ``selected``.
    """
    chain = _chain_candidates(candidates, parameters)
    beside = np.all(~chain.exclusive[selected], axis=0)
    beside[selected] = False
    if not len(selected) or not beside.any():
        return selected
    pool = np.concatenate([selected, np.flatnonzero(beside)])
    longer, log_odds = _best_chain(chain.take(pool), points, parameters, parameters.max_count, axis)
    surplus = len(longer) - len(selected)
    if surplus <= 0 or not np.isin(np.arange(len(selected)), longer).all():
        return selected
    _, without = _best_chain(chain.take(selected), points, parameters, parameters.max_count, axis)
    return pool[longer] if log_odds - without >= surplus * parameters.surplus_log_odds else selected


def _chain_candidates(candidates: TriadCandidates, parameters: SelectionParameters) -> ChainCandidates:
    """Return the candidates as members of the chain; they exclude each other if they share a feature or would touch."""
    gaps = np.linalg.norm(candidates.origin_mm[:, None] - candidates.origin_mm, axis=-1)
    exclusive = share_features(candidates) | (gaps < parameters.chain.min_gap_mm)
    return ChainCandidates(candidates.origin_mm, candidates.log_odds, exclusive)


def _best_chain(
    candidates: ChainCandidates,
    points: Points,
    parameters: SelectionParameters,
    max_length: int,
    axis: SpineAxis,
) -> tuple[Int, float]:
    """Return the indices (k,) of the most likely chain, and its log-odds."""
    volume = chance_volume_mm3(points, parameters)
    axes = (0, 1) if axis == "auto" else ("xy".index(axis),)
    return max(
        (best_chain(candidates, a, volume, max_length, parameters.chain) for a in axes),
        key=lambda found: found[1],
    )


def chance_volume_mm3(points: Points, parameters: SelectionParameters) -> float:
    """Return the volume in which chance triads are taken to be uniformly distributed.

    Parameters
    ----------
    points
        All triangulated points, at least one.
    parameters
        Its smallest value.

    Returns
    -------
    float
        Volume of the points' extent, mm^3.
    """
    return max(float(np.prod(np.ptp(points.position_mm, axis=0))), parameters.min_volume_mm3)
