import numpy as np
import pytest

from contract.burst import Burst, BurstPair
from contract.pose import PoseFields, pose_model
from contract.stage import StageResult
from spinewatch.tracking.burst import BurstParameters, combine_burst
from spinewatch.triads.pose import Pose
from tests.store.builders import stage_result, triad
from workers.burst_edits import edit_burst


def fields(x_mm: float) -> PoseFields:
    return pose_model(Pose(np.array([x_mm, 0.0, 0.0]), np.eye(3), 0.01 * np.eye(6)))


def burst(*labels: str | None) -> StageResult:
    """The result of two pairs with triads under some labels; None for one that only the first pair shows."""
    shown: list[str] = [label for label in ("L1", "T11") if label is not None]
    poses = [{label: fields(50.0 * k + pair) for k, label in enumerate(shown)} for pair in (0, 1)]
    pairs = [
        BurstPair(offset_s=None, view_delay_s=None, poses=one, outliers=[], labelled_by=None, flags=[])
        for one in poses
    ]
    combined = combine_burst([{label: p.pose() for label, p in one.items()} for one in poses])  # type: ignore[misc]
    return stage_result(
        [triad(label) for label in labels], burst=Burst.of(combined, pairs, "L1", BurstParameters())
    )


def test_means_are_those_of_the_pairs_under_the_new_labels() -> None:
    after = edit_burst(burst("L1", "T9"), ["L1", "T11"], "L1")
    assert after.burst is not None
    assert [sorted(pair.poses) for pair in after.burst.pairs] == [["L1", "T9"]] * 2
    assert after.burst.pairs_used == {"L1": 2, "T9": 2}
    assert after.triads[1].position_mm == pytest.approx([50.5, 0, 0])


def test_a_label_that_is_taken_away_leaves_the_pairs() -> None:
    after = edit_burst(burst("L1", None), ["L1", "T11"], "L1")
    assert after.burst is not None
    assert after.burst.pairs_used == {"L1": 2}
    assert after.triads[1].position_mm == [1.0, 2.0, 3.0]


def test_a_triad_of_one_pair_has_its_pose_there_once_it_is_labelled() -> None:
    after = edit_burst(burst("L1", "T11", "T7"), ["L1", "T11", None], "L1")
    assert after.burst is not None
    assert [sorted(pair.poses) for pair in after.burst.pairs] == [["L1", "T11", "T7"], ["L1", "T11"]]
    assert after.burst.pairs_used["T7"] == 1
    assert "burst-incomplete" in [flag.code for flag in after.flags]
