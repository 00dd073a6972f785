from dataclasses import replace

import numpy as np

from contract.revision import LabelEdit, TriadEdits
from contract.stage import StageResult
from spinewatch.flags import Flag
from spinewatch.stage import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import MeasuredTriad, Pose
from store.measurements import MeasuredStage
from tests.contract.results import measurement
from tests.store.builders import stage_result, triad
from workers.stage_decisions import Decision, decide, decided, decisions_of, excluded, removed_by

LABELS = ("L1", "T11", "T9")
UNCERTAIN = Flag("labels-uncertain", "which?")


def pair(*labels: str | None) -> StageMeasurement:
    """A pair whose triads are 50 mm apart."""
    triads = tuple(
        LabelledTriad(
            label, None, MeasuredTriad("m", {}, Pose(np.array([50.0 * k, 0, 0]), np.eye(3), np.eye(6)), 0.0)
        )
        for k, label in enumerate(labels)
    )
    return replace(measurement(), triads=triads, flags=(UNCERTAIN,))


def at(x_mm: float, label: str | None, manual: bool = True) -> Decision:
    return Decision(label, np.array([x_mm, 0.0, 0.0]), manual)


def labels(measured: StageMeasurement) -> list[str | None]:
    return [triad.label for triad in measured.triads]


def test_a_person_s_label_stays_with_the_nearest_triad() -> None:
    after = decide(pair(None, None, None), [at(48, "T11"), at(3, "L1"), at(104, "T9")], LABELS)
    assert labels(after) == ["L1", "T11", "T9"]
    assert after.flags == ()
    far = decide(pair(None, None), [at(25, "T11")], LABELS)
    assert labels(far) == [None, None]
    assert far.flags == (UNCERTAIN,)


def test_another_triad_loses_the_label_that_a_person_gave() -> None:
    after = decide(pair("L1", "T11", "T9"), [at(0, "T11")], LABELS)
    assert labels(after) == ["T11", "T9", None]
    assert after.triads[2].label_reason == "a person gave this label to another triad"


def test_a_label_that_was_taken_away_stays_away() -> None:
    after = decide(pair("L1", "T11"), [at(50, None)], LABELS)
    assert labels(after) == ["L1", None]
    assert after.triads[1].label_reason == "the label was taken away by a person"


def test_found_labels_count_only_where_none_is_found_again() -> None:
    kept = decide(pair(None, None), [at(0, "L1", False), at(50, "T11", False)], LABELS)
    assert labels(kept) == ["L1", "T11"]
    newer = decide(pair("T11", "T9"), [at(0, "L1", False), at(50, "T11", False)], LABELS)
    assert labels(newer) == ["T11", "T9"]


def result(*places: tuple[float, str | None, bool]) -> StageResult:
    return stage_result(
        [triad(label, position_mm=[x, 0.0, 0.0], label_manual=manual) for x, label, manual in places]
    )


def test_decisions_are_those_of_earlier_revisions_and_of_the_edits() -> None:
    before = result((0, "L1", False), (50, "T11", True), (100, None, False), (150, "T9", True))
    edits = TriadEdits(kind="edit", take=1, labels=[LabelEdit(triad=2, label="T8")], removed=[3])
    found = [(decision.label, decision.manual) for decision in decisions_of(before, edits)]
    assert found == [("T11", True), ("T8", True), ("L1", False)]
    assert [decision.label for decision in decisions_of(before, None)] == ["T11", "T9"]
    (gone,) = removed_by(before, edits)
    (place,) = excluded([gone])
    assert place.position_mm is not None
    assert place.position_mm.tolist() == [150, 0, 0]
    assert place.left_px.shape == (0, 2)


def test_labels_of_persons_are_marked_and_lost_ones_flagged() -> None:
    measured = MeasuredStage(result((0, "L1", False), (50, "T11", False)))
    after = decided(measured, [at(1, "L1"), at(200, "T9"), at(50, "T11", False)], []).result
    assert [one.label_manual for one in after.triads] == [True, False]
    lost = [flag.detail for flag in after.flags if flag.code == "edit-lost"]
    assert len(lost) == 1
    assert "T9" in lost[0]


def test_labels_kept_against_a_revised_stage_are_flagged() -> None:
    measured = MeasuredStage(result((0, "L1", False)))
    after = decided(measured, [at(0, "L1")], [], relabelled=True).result
    assert [flag.code for flag in after.flags] == ["a-flag", "labels-kept"]
    assert decided(measured, [], [], relabelled=True).result.flags == measured.result.flags
