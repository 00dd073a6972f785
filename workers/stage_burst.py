"""The result of a burst: poses combined over its pairs, and everything else of the pair that shows it first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from contract.burst import Burst, BurstPair
from contract.flag import Flag
from contract.pose import pose_model
from contract.stage import StageResult
from contract.triad import Triad
from spinewatch.tracking.burst import BurstParameters, combine_burst
from store.stage_work import PairWork
from workers.stage_labels import LabelledPair

_SECOND = timedelta(seconds=1)


def view_delay_s(pair: PairWork) -> float | None:
    """Return the time of the right exposure minus that of the left one.

    Parameters
    ----------
    pair
        The pair.

    Returns
    -------
    float or None
        Delay, s; None without these times.
    """
    if pair.left_exposed_at is None or pair.right_exposed_at is None:
        return None
    return (pair.right_exposed_at - pair.left_exposed_at) / _SECOND


def offsets_s(pairs: Sequence[PairWork]) -> list[float] | None:
    """Return the times of pairs since the first one, each in the middle of its exposures.

    Parameters
    ----------
    pairs
        The pairs.

    Returns
    -------
    list of float or None
        Times, s; None unless all are known.
    """
    times = [_middle(pair) for pair in pairs]
    known = [time for time in times if time is not None]
    return [(time - known[0]) / _SECOND for time in known] if len(known) == len(times) else None


def burst_result(
    pairs: Sequence[PairWork],
    labelled: Sequence[LabelledPair],
    labels: Sequence[str],
    reference: str,
    made: tuple[str, Mapping[str, Any]],
) -> StageResult:
    """Return the result of a burst.

    Parameters
    ----------
    pairs
        The pairs.
    labelled
        Their measurements with labels.
    labels
        All labels, in order.
    reference
        The reference vertebra.
    made
        Version of Spinewatch, and the settings that are stored beside the parameters.

    Returns
    -------
    StageResult
        The result: poses are means over the pairs; features, fields, exposure and the check of the rig are those of the
        first pair, the balls of a triad those of the first pair that shows its pose.
    """
    times, parameters = offsets_s(pairs), BurstParameters()
    combined = combine_burst(
        [pair.poses for pair in labelled], None if times is None else np.array(times), reference, parameters
    )
    documents = [
        BurstPair(
            offset_s=None if times is None else times[k],
            view_delay_s=view_delay_s(pair),
            poses={label: pose_model(pose) for label, pose in one.poses.items()},
            outliers=[],
            labelled_by=one.labelled_by,
            flags=Flag.of(one.measurement.flags),
        )
        for k, (pair, one) in enumerate(zip(pairs, labelled, strict=True))
    ]
    results = [StageResult.of(one.measurement, *made) for one in labelled]
    triads = [
        shown.model_copy(update=dict(pose_model(combined.poses[label])))
        for label in labels
        if label in combined.poses and (shown := _first(results, label)) is not None
    ]
    other = [triad for triad in results[0].triads if triad.label is None or triad.label not in combined.poses]
    delays = [delay for delay in map(view_delay_s, pairs) if delay is not None]
    sources = [one.labelled_by for one in labelled if one.labelled_by is not None]
    return results[0].model_copy(
        update={
            "triads": [*triads, *other],
            "flags": [*_joined(results), *Flag.of(combined.flags)],
            "view_delay_s": max(delays, key=abs) if delays else None,
            "labelled_by": next((source for source in sources if source.pair is None), None),
            "burst": Burst.of(combined, documents, reference, parameters),
        }
    )


def _middle(pair: PairWork) -> datetime | None:
    """Return the middle of the exposures of a pair, None when one is unknown."""
    if pair.left_exposed_at is None or pair.right_exposed_at is None:
        return None
    return pair.left_exposed_at + (pair.right_exposed_at - pair.left_exposed_at) / 2


def _first(results: Iterable[StageResult], label: str) -> Triad | None:
    """Return the triad of a label in the first pair that shows its pose."""
    shown = (triad for result in results for triad in result.triads)
    return next((t for t in shown if t.label == label and t.position_mm is not None), None)


def _joined(results: Sequence[StageResult]) -> list[Flag]:
    """Return one flag for each code that pairs raise, with the detail of the first and the number of the others."""
    raised: dict[str, list[tuple[int, str]]] = {}
    for number, result in enumerate(results, start=1):
        for flag in result.flags:
            raised.setdefault(flag.code, []).append((number, flag.detail))
    flags = []
    for code, details in raised.items():
        number, detail = details[0]
        pairs = len({n for n, _ in details})
        more = f" (and so in {pairs - 1} more of {len(results)} pairs)" if pairs > 1 else ""
        flags.append(Flag(code=code, detail=f"pair {number}: {detail}{more}"))
    return flags
