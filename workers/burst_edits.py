"""The means of a burst after a person has edited labels: combined again from the poses of its pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contract.burst import Burst, BurstPair
from contract.flag import Flag
from contract.pose import pose_model
from contract.stage import StageResult
from spinewatch.tracking.burst import BurstParameters, combine_burst
from spinewatch.triads.pose import Pose

_COMBINED = frozenset({"burst-outlier", "burst-incomplete", "breathing-unresolved"})
"""Codes of the flags of the combination."""


def edit_burst(result: StageResult, before: Sequence[str | None], reference: str) -> StageResult:
    """Return the result of a burst whose triads have other labels, or are fewer.

    Parameters
    ----------
    result
        The result of a burst with the triads that are kept, under their new labels.
    before
        The labels of these triads in the pairs, in the same order.
    reference
        The reference vertebra.

    Returns
    -------
    StageResult
        Means, breathing and flags from the poses of the pairs under the new labels. A triad without a label is known
        from one pair: its pose is one of the first pair when it is labelled; when its label is taken away, its mean
        stays.
    """
    burst = result.burst
    assert burst is not None  # noqa: S101 - the caller has looked
    renamed = {old: triad.label for old, triad in zip(before, result.triads, strict=True) if old is not None}
    poses = [_renamed(pair, renamed) for pair in burst.pairs]
    for old, triad in zip(before, result.triads, strict=True):
        single = triad.pose()
        if old is None and triad.label is not None and single is not None:
            poses[0][triad.label] = single
    times = [pair.offset_s for pair in burst.pairs]
    known = [time for time in times if time is not None]
    parameters = BurstParameters()
    combined = combine_burst(
        poses, np.array(known) if len(known) == len(times) else None, reference, parameters
    )
    pairs = [
        pair.model_copy(
            update={"poses": {label: pose_model(pose) for label, pose in shown.items()}, "outliers": []}
        )
        for pair, shown in zip(burst.pairs, poses, strict=True)
    ]
    triads = [
        triad
        if (mean := combined.poses.get(triad.label or "")) is None
        else triad.model_copy(update=dict(pose_model(mean)))
        for triad in result.triads
    ]
    kept = [flag for flag in result.flags if flag.code not in _COMBINED]
    return result.model_copy(
        update={
            "triads": triads,
            "flags": [*kept, *Flag.of(combined.flags)],
            "burst": Burst.of(combined, pairs, reference, parameters),
        }
    )


def _renamed(pair: BurstPair, labels: dict[str, str | None]) -> dict[str, Pose]:
    """Return the poses of a pair under their new labels, without those whose triad has none now."""
    found = {labels.get(old): fields.pose() for old, fields in pair.poses.items()}
    return {label: pose for label, pose in found.items() if label is not None and pose is not None}
