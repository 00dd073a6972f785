"""The likeliest row of triads along the spine, of which no two share a feature: an exact choice.

Dynamic programming along the spine finds the best row when only neighbours must exclude each other. That
relaxed optimum bounds the true one from above. Where it uses a feature twice, the problem is split in two,
each without one of the two triads, and the half with the higher bound is examined first: the first row found
that shares nothing is the best of all.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import count

import numpy as np

from spinewatch.arrays import Bool, Float, Int

_STEP_SHARES = {1.0: 0.72, 2.0: 0.08, 3.0: 0.04, 0.5: 0.04, 1.5: 0.04, 2 / 3: 0.04, 1 / 3: 0.02, 4 / 3: 0.02}
"""How often a gap between neighbours has this ratio to the row's spacing: levels skipped, or a triad unseen."""
_MOST_SPLITS = 500


@dataclass(frozen=True)
class ChainParameters:
    """What is known of a row of triads before an image is seen.

    ``spacing_mm`` (least, most) that is usual in a row, ``spacing_sd`` its relative irregularity;
    ``shortest_mm`` between neighbours, which would touch if closer; ``slope_sd`` of a straight row against
    the spine axis, sideways and in height, ``curved_sd`` of the share ``curved`` of steps in a bent one;
    ``slope_limit`` of any. ``min_log_odds`` that a triad must add (4.6 is 100 to 1).
    """

    spacing_mm: tuple[float, float] = (30.0, 80.0)
    spacing_sd: float = 0.12
    shortest_mm: float = 20.0
    slope_sd: float = 0.3
    curved_sd: float = 1.0
    curved: float = 0.1
    slope_limit: float = 2.5
    min_log_odds: float = 4.6


@dataclass(frozen=True, eq=False)
class ChainCandidates:
    """c possible triads: origins (c, 3), ``log_odds`` (c,) for each alone, and which pairs exclude each other."""

    origin_mm: Float
    log_odds: Float
    exclusive: Bool


def best_chain(
    places: ChainCandidates, axis: int, volume_mm3: float, limit: int, parameters: ChainParameters
) -> tuple[Int, float]:
    """Return the members (k,) of the likeliest row, in order along the axis, and its logarithm of odds.

    At most ``limit`` of them; no two exclusive. An empty row has odds of 0. Exact for a spacing from a list
    of ten; splitting ends after 500 rows, which no scene has come near, with the best row that drops the
    weaker of each pair still in conflict.
    """
    worth = places.log_odds - parameters.min_log_odds
    spacings = np.geomspace(*parameters.spacing_mm, 10)
    steps = step_gains(places, axis, volume_mm3, spacings, parameters)
    order = count()

    def examine(excluded: frozenset[int]) -> tuple[float, int, frozenset[int], Int]:
        allowed = worth.copy()
        allowed[list(excluded)] = -np.inf
        row, value = _relaxed(allowed, steps, limit)
        return -value, next(order), excluded, row

    heap = [examine(frozenset())]
    while True:
        negative, number, excluded, row = heapq.heappop(heap)
        conflict = _conflict(row, places.exclusive)
        if conflict is None:
            return row, -negative
        if number > _MOST_SPLITS:
            weaker = min(conflict, key=lambda k: places.log_odds[k])
            heap = [examine(excluded | {weaker})]
            continue
        for member in conflict:
            heapq.heappush(heap, examine(excluded | {member}))


def _relaxed(worth: Float, steps: Float, limit: int) -> tuple[Int, float]:
    """Return the best row (k,) if only neighbours exclude each other, and its value."""
    value = np.tile(worth, (len(steps), 1))
    best, row = 0.0, np.empty(0, dtype=np.intp)
    before: list[Int] = []
    for length in range(1, limit + 1):
        s, last = np.unravel_index(np.argmax(value), value.shape)
        if value[s, last] > best:
            best, row = float(value[s, last]), _trace(before, int(s), int(last))
        if length == limit:
            break
        total = value[:, :, None] + steps
        before.append(total.argmax(axis=1))
        value = total.max(axis=1) + worth
        if not np.any(value > -np.inf):
            break
    return row, best


def _conflict(row: Int, exclusive: Bool) -> tuple[int, int] | None:
    pairs = np.argwhere(np.triu(exclusive[np.ix_(row, row)], 1))
    return (int(row[pairs[0][0]]), int(row[pairs[0][1]])) if len(pairs) else None


def _trace(before: list[Int], spacing: int, last: int) -> Int:
    row = [last]
    for previous in reversed(before):
        row.append(int(previous[spacing, row[-1]]))
    return np.array(row[::-1], dtype=np.intp)


def step_gains(
    places: ChainCandidates, axis: int, volume_mm3: float, spacings: Float, p: ChainParameters
) -> Float:
    """Return (s, c, c): how much likelier j lies where it is as i's next neighbour than by chance."""
    d = places.origin_mm[None] - places.origin_mm[:, None]
    along, length = d[..., axis], np.linalg.norm(d, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.delete(d, axis, axis=-1) / along[..., None]
    possible = (along > 0) & np.all(np.abs(slopes) <= p.slope_limit, axis=-1) & ~places.exclusive
    i, j = np.nonzero(possible)
    across = (slopes[i, j] ** 2).sum(axis=1)
    direction = np.logaddexp(
        np.log1p(-p.curved) + _log_normal_2d(across, p.slope_sd),
        np.log(p.curved) + _log_normal_2d(across, p.curved_sd),
    )
    grid, density = _ratio_density(p.spacing_sd)
    ratio = np.log(length[i, j]) - np.log(spacings)[:, None]
    spacing = np.interp(ratio, grid, density, left=-np.inf, right=-np.inf)
    size = np.log(length[i, j]) + 2 * np.log(along[i, j])  # from ratio and slopes to mm
    gains = np.full((len(spacings), *possible.shape), -np.inf)
    gains[:, i, j] = spacing + direction + (np.log(volume_mm3) - size)
    return gains


def _log_normal_2d(squares: Float, sd: float) -> Float:
    return np.asarray(-0.5 * squares / sd**2 - np.log(2 * np.pi * sd**2))


def _ratio_density(sd: float) -> tuple[Float, Float]:
    """Return a grid of logarithms of gap over spacing and their log-density there."""
    grid = np.linspace(np.log(1 / 3) - 4 * sd, np.log(3) + 4 * sd, 400)
    density = np.zeros_like(grid)
    for ratio, share in _STEP_SHARES.items():
        spread = sd / np.sqrt(max(ratio, 1.0))
        density += (
            share * np.exp(-0.5 * ((grid - np.log(ratio)) / spread) ** 2) / (np.sqrt(2 * np.pi) * spread)
        )
    return grid, np.log(density + 1e-12)
