"""The most likely chain of triads along the spine in which no two exclude each other: an exact optimum.

Dynamic programming finds the best chain if only neighbours exclude each other. The value of this relaxed problem is
an upper bound of the true one. Where its chain contains two triads that exclude each other, the problem is split in
two, each without one of them, and the part with the higher bound is examined first (branch and bound). The first chain
without a conflict is the best of all.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from functools import cached_property
from itertools import count

import numpy as np

from spinewatch.arrays import Bool, Float, Int

_GRID = 400
"""Number of samples of the density of gaps."""

_MIN_DENSITY = 1e-12
"""Floor of the density of gaps, whose logarithm would be infinite."""


@dataclass(frozen=True)
class ChainParameters:
    """Prior knowledge of the chain of triads.

    Attributes
    ----------
    spacing_mm
        Smallest and largest usual spacing of a chain, mm.
    n_spacings
        Number of spacings tried between the two.
    spacing_sd
        Relative standard deviation of a gap from the spacing.
    gap_ratios
        Pairs of (ratio of a gap to the spacing, probability): levels skipped, or triads not detected.
    min_gap_mm
        Smallest distance between two triads, which would touch if they were nearer, mm.
    slope_sd
        Standard deviation of the slope of a step against the spine axis, sideways and in height.
    bent_slope_sd
        The same for steps in a strongly curved part.
    bent_probability
        Probability of such a step.
    max_slope
        Largest slope of a step.
    min_log_odds
        Smallest contribution of a triad to the log-odds of the chain; 4.6 is 100 to 1.
    max_splits
        Number of subproblems after which the weaker triad of a conflict is dropped instead of splitting.
    """

    spacing_mm: tuple[float, float] = (30.0, 80.0)
    n_spacings: int = 10
    spacing_sd: float = 0.12
    gap_ratios: tuple[tuple[float, float], ...] = (
        (1.0, 0.72),
        (2.0, 0.08),
        (3.0, 0.04),
        (0.5, 0.04),
        (1.5, 0.04),
        (2 / 3, 0.04),
        (1 / 3, 0.02),
        (4 / 3, 0.02),
    )
    min_gap_mm: float = 20.0
    slope_sd: float = 0.3
    bent_slope_sd: float = 1.0
    bent_probability: float = 0.1
    max_slope: float = 2.5
    min_log_odds: float = 4.6
    max_splits: int = 500

    @cached_property
    def spacings_mm(self) -> Float:
        """Spacings that are tried, shape (s,), mm."""
        return np.geomspace(*self.spacing_mm, self.n_spacings)

    @cached_property
    def log_gap_density(self) -> tuple[Float, Float]:
        """Logarithms of gap over spacing, shape (g,), and the log density there, shape (g,)."""
        ratios, sd = np.log([ratio for ratio, _ in self.gap_ratios]), self.spacing_sd
        grid = np.linspace(ratios.min() - 4 * sd, ratios.max() + 4 * sd, _GRID)
        density = np.zeros_like(grid)
        for ratio, probability in self.gap_ratios:
            sd = self.spacing_sd / np.sqrt(max(ratio, 1.0))
            density += (
                probability * np.exp(-0.5 * ((grid - np.log(ratio)) / sd) ** 2) / (np.sqrt(2 * np.pi) * sd)
            )
        return grid, np.log(density + _MIN_DENSITY)


@dataclass(frozen=True, eq=False)
class ChainCandidates:
    """c triads that may be members of the chain.

    Attributes
    ----------
    origin_mm
        Origins, shape (c, 3), object space, mm.
    log_odds
        Log-odds of each on its own, shape (c,).
    exclusive
        Whether two of them exclude each other, shape (c, c).
    """

    origin_mm: Float
    log_odds: Float
    exclusive: Bool

    def take(self, index: Int) -> ChainCandidates:
        """Return a selection of the candidates.

        Parameters
        ----------
        index
            Their indices, shape (k,).

        Returns
        -------
        ChainCandidates
            The selected candidates, in the order of the index.
        """
        return ChainCandidates(
            self.origin_mm[index], self.log_odds[index], self.exclusive[index[:, None], index]
        )


def best_chain(
    candidates: ChainCandidates, axis: int, volume_mm3: float, max_length: int, parameters: ChainParameters
) -> tuple[Int, float]:
    """Return the most likely chain.

    Parameters
    ----------
    candidates
        Triads that may be members.
    axis
        Object axis along which the spine extends: 0 or 1.
    volume_mm3
        Volume in which chance triads are uniformly distributed, mm^3.
    max_length
        Largest number of members.
    parameters
        Prior knowledge of the chain.

    Returns
    -------
    members : Int
        Indices of the members in order along the axis, shape (k,); empty if no chain is more likely than none.
    log_odds : float
        Log-odds of the chain, 0 for an empty one.

    References
    ----------
    Replaces heuristics H1 to H5 of thesis section 5.6; branch and bound after A. H. Land and A. G. Doig, Econometrica
    28 (1960) 497.

    Examples
    --------
    >>> import numpy as np
    >>> origins = np.array([[0.0, 0, 0], [50, 0, 0], [52, 3, 0], [100, 0, 0]])
    >>> exclusive = np.linalg.norm(origins[:, None] - origins, axis=-1) < 20
    >>> candidates = ChainCandidates(origins, np.array([9.0, 9.0, 7.0, 9.0]), exclusive)
    >>> members, _ = best_chain(candidates, 0, 200.0**3, 4, ChainParameters())
    >>> members
    array([0, 1, 3])
    """
    gains = candidates.log_odds - parameters.min_log_odds
    steps = step_log_odds(candidates, axis, volume_mm3, parameters)
    order = count()

    def examine(excluded: frozenset[int]) -> tuple[float, int, frozenset[int], Int]:
        allowed = gains.copy()
        allowed[list(excluded)] = -np.inf
        chain, value = _relaxed(allowed, steps, max_length)
        return -value, next(order), excluded, chain

    heap = [examine(frozenset())]
    while True:
        negative, number, excluded, chain = heapq.heappop(heap)
        conflict = _conflict(chain, candidates.exclusive)
        if conflict is None:
            return chain, -negative
        if number > parameters.max_splits:
            weaker = min(conflict, key=lambda k: candidates.log_odds[k])
            heap = [examine(excluded | {weaker})]
            continue
        for member in conflict:
            heapq.heappush(heap, examine(excluded | {member}))


def step_log_odds(
    candidates: ChainCandidates, axis: int, volume_mm3: float, parameters: ChainParameters
) -> Float:
    """Return the log-odds of steps between neighbours: the likelihood as a step of the chain to that by chance.

    Parameters
    ----------
    candidates
        c triads that may be members.
    axis
        Object axis along which the spine extends: 0 or 1.
    volume_mm3
        Volume in which chance triads are uniformly distributed, mm^3.
    parameters
        Prior knowledge of the chain.

    Returns
    -------
    Float
        Log-odds of j as the next neighbour of i for each of the s spacings that are tried, shape (s, c, c); minus
        infinity where impossible.
    """
    p, origin = parameters, candidates.origin_mm
    across = np.arange(3) != axis
    d = origin[None] - origin[:, None]
    possible = np.abs(d[..., across]).max(axis=-1) <= p.max_slope * d[..., axis]
    i, j = np.nonzero(possible & (d[..., axis] > 0) & ~candidates.exclusive)
    step = d[i, j]
    along, length = step[:, axis], np.sqrt((step * step).sum(axis=1))
    squared_slope = ((step[:, across] / along[:, None]) ** 2).sum(axis=1)
    direction = np.logaddexp(
        np.log1p(-p.bent_probability) + _log_normal_2d(squared_slope, p.slope_sd),
        np.log(p.bent_probability) + _log_normal_2d(squared_slope, p.bent_slope_sd),
    )
    log_length = np.log(length)
    log_ratio = log_length - np.log(p.spacings_mm)[:, None]
    spacing = np.interp(log_ratio, *p.log_gap_density, left=-np.inf, right=-np.inf)
    log_jacobian = log_length + 2 * np.log(along)  # from log ratio and slopes to mm
    log_odds = np.full((p.n_spacings, *possible.shape), -np.inf)
    log_odds[:, i, j] = spacing + direction + (np.log(volume_mm3) - log_jacobian)
    return log_odds


def _relaxed(gains: Float, steps: Float, max_length: int) -> tuple[Int, float]:
    """Return the best chain (k,) if only neighbours exclude each other, and its value."""
    value, into = np.tile(gains, (len(steps), 1)), np.ascontiguousarray(np.swapaxes(steps, 1, 2))
    best, chain = 0.0, np.empty(0, dtype=np.intp)
    predecessors: list[Int] = []
    for length in range(1, max_length + 1):
        s, last = np.unravel_index(np.argmax(value), value.shape)
        if value[s, last] > best:
            best, chain = float(value[s, last]), _backtrack(predecessors, int(s), int(last))
        if length == max_length:
            break
        total = value[:, None, :] + into
        predecessors.append(total.argmax(axis=2))
        value = np.take_along_axis(total, predecessors[-1][..., None], axis=2)[..., 0] + gains
        if not np.any(value > -np.inf):
            break
    return chain, best


def _backtrack(predecessors: list[Int], spacing: int, last: int) -> Int:
    """Return the chain (k,) that ends in a member, from the predecessors (s, c) of each length."""
    chain = [last]
    for predecessor in reversed(predecessors):
        chain.append(int(predecessor[spacing, chain[-1]]))
    return np.array(chain[::-1], dtype=np.intp)


def _conflict(chain: Int, exclusive: Bool) -> tuple[int, int] | None:
    """Return the first two members of a chain that exclude each other."""
    pairs = np.argwhere(np.triu(exclusive[np.ix_(chain, chain)], 1))
    return (int(chain[pairs[0][0]]), int(chain[pairs[0][1]])) if len(pairs) else None


def _log_normal_2d(squares: Float, sd: float) -> Float:
    """Return the log density of an isotropic normal distribution in the plane, of squared lengths (n,)."""
    return np.asarray(-0.5 * squares / sd**2 - np.log(2 * np.pi * sd**2))
