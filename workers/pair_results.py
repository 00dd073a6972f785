"""What each pair of a stage was measured from, as it is stored."""

from __future__ import annotations

from collections.abc import Sequence

from contract.explanation import Explanation
from contract.features import ExposurePair, FeaturePair, FieldPair
from contract.pair_result import PairFeatures, PairResult
from contract.stage import StageResult
from spinewatch.stage import StageMeasurement


def pair_results(measured: Sequence[StageMeasurement], result: StageResult) -> tuple[PairResult, ...]:
    """Return what the pairs of a stage were measured from.

    Parameters
    ----------
    measured
        Measurements of the pairs with their labels.
    result
        The result of the stage.

    Returns
    -------
    tuple of PairResult
        One per pair. The triads of a burst are those of its means by label; one without a label is the first pair's.
    """
    if result.burst is None:
        return (PairResult(explanation=Explanation.of(measured[0])),)
    labels = {triad.label: place for place, triad in enumerate(result.triads) if triad.label is not None}
    unlabelled = [place for place, triad in enumerate(result.triads) if triad.label is None]
    return tuple(
        PairResult(
            features=None if number == 0 else _features(measurement),
            explanation=_placed(measurement, labels, unlabelled if number == 0 else ()),
        )
        for number, measurement in enumerate(measured)
    )


def _placed(
    measurement: StageMeasurement, labels: dict[str, int], unlabelled: Sequence[int]
) -> Explanation | None:
    explanation = Explanation.of(measurement)
    if explanation is None:
        return None
    rest = iter(unlabelled)
    places: dict[int, int | None] = {
        number: next(rest, None) if triad.label is None else labels.get(triad.label)
        for number, triad in enumerate(measurement.triads)
    }
    return explanation.placed(places)


def _features(measurement: StageMeasurement) -> PairFeatures:
    left, right = measurement.left, measurement.right
    return PairFeatures(
        features=FeaturePair.of(left.features, right.features),
        fields=FieldPair.of(left.field, right.field),
        exposure=ExposurePair(left=str(left.exposure), right=str(right.exposure)),
    )
