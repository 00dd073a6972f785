"""Ball centres of the sample edited, and the pair matched again."""

from functools import lru_cache

import pytest

from contract.explanation import Explanation
from contract.pair_result import PairResult
from contract.revision import TriadEdits
from contract.stage import StageResult
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.pipeline import StageMeasurer
from spinewatch.progress import silent
from spinewatch.stage import StageMeasurement, StageRequest
from store.errors import FeaturesMissingError
from store.measurements import MeasuredStage
from tests.stage_images import sample
from tests.store.builders import RIG
from workers.stage_centres import EditedTake

REQUEST = StageRequest(labels=("L1", "T11", "T9", "T7"), spine_axis="x")


@lru_cache
def first() -> tuple[StageMeasurer, tuple[Frame, Frame], MeasuredStage]:
    left, right = sample("PRE")
    frames = Frame(decode_image(left), "left"), Frame(decode_image(right), "right")
    measurer = StageMeasurer(RIG)
    measurement = measurer.measure(*frames, REQUEST, explained=True)
    explanation = Explanation.of(measurement)
    return (
        measurer,
        frames,
        MeasuredStage(StageResult.of(measurement, "0"), (PairResult(explanation=explanation),)),
    )


def matched(edits: TriadEdits | None, pair: int = 1) -> StageMeasurement:
    measurer, frames, before = first()
    return EditedTake(before, edits).measure(measurer, pair, frames, REQUEST, silent)


def test_without_edits_the_result_is_the_same() -> None:
    again = StageResult.of(matched(None), "0")
    before = first()[2].result
    assert again.features.left[0].x == before.features.left[0].x
    assert [triad.label for triad in again.triads] == [triad.label for triad in before.triads]
    for after, triad in zip(again.triads, before.triads, strict=True):
        assert after.position_mm == pytest.approx(triad.position_mm, abs=1e-6)
    assert again.flags == before.flags


def test_edits_of_other_pairs_do_not_count_and_missing_features_are_named() -> None:
    add = {"action": "add", "side": "left", "x": 10.0, "y": 10.0, "pair": 2}
    edits = TriadEdits.model_validate({"kind": "edit", "take": 1, "centres": [add]})
    assert not matched(edits).left.features.is_manual.any()
    with pytest.raises(FeaturesMissingError, match="pair 2"):
        matched(edits, 2)


def test_a_removed_triad_is_not_found_again_and_a_moved_centre_is_marked() -> None:
    before = first()[2].result
    x, y = before.triads[0].balls["XX"].left or (0, 0)
    place = next(k for k, feature in enumerate(before.features.left) if (feature.x, feature.y) == (x, y))
    move = {"action": "move", "side": "left", "feature": place, "x": x + 0.5, "y": y}
    edits = TriadEdits.model_validate({"kind": "edit", "take": 1, "removed": [3], "centres": [move]})
    after = matched(edits)
    assert len(after.triads) == 3
    ball = after.triads[0].triad.balls["XX"]
    assert ball.manual_in == ("left",)
    assert "ball-manual" in [flag.code for flag in after.flags]
