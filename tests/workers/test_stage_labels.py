"""Labels by an earlier stage, or by another pair of the burst, where triads are missing."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from spinewatch.flags import Flag
from spinewatch.stage import StageMeasurement, StageRequest
from spinewatch.triads.labels import label_triads
from spinewatch.triads.pose import MeasuredTriad, Pose
from store.stage_work import LabelledStage, StageWork
from tests.contract.results import measurement
from tests.store.builders import NOON
from workers.registry import NotReadyError
from workers.stage_labels import label_pairs

LABELS = ("L1", "T11", "T9", "T7")
REQUEST = StageRequest(labels=LABELS, spine_axis="x")
PLACES = {"L1": 0.0, "T11": 62.0, "T9": 114.0, "T7": 160.0}


def pose(x_mm: float) -> Pose:
    return Pose(np.array([x_mm, 0.0, 0.0]), np.eye(3), 0.01 * np.eye(6))


def showing(*labels: str) -> StageMeasurement:
    """A pair that shows some triads, labelled by itself."""
    found = [MeasuredTriad("flat-10-14-18", {}, pose(PLACES[label]), 0.0) for label in labels]
    triads, flags = label_triads(found, LABELS, "x")
    return replace(measurement(), triads=triads, flags=(Flag("image-dark", "left"), *flags))


def work(labelled: LabelledStage | None = None, unended_job: str | None = None) -> StageWork:
    return StageWork(
        left=b"",
        right=b"",
        sha256={},
        rig={},
        captured_at=None,
        calibrated_at=None,
        calibration_created_at=NOON,
        calibration_age=timedelta(0),
        earlier=(),
        vertebrae=LABELS,
        spine_axis="x",
        extra_levels=(),
        name="POST",
        take=2,
        labelled=labelled,
        unended_job=unended_job,
    )


PRE = LabelledStage("PRE", 1, {label: pose(x) for label, x in PLACES.items()})


def labels(measured: StageMeasurement) -> list[str | None]:
    return [triad.label for triad in measured.triads]


def test_an_earlier_stage_decides_which_triad_is_missing() -> None:
    alone = showing("L1", "T11", "T9")
    assert labels(alone) == [None] * 3
    (pair,) = label_pairs([alone], REQUEST, work(PRE))
    assert labels(pair.measurement) == ["L1", "T11", "T9"]
    assert pair.labelled_by is not None
    assert (pair.labelled_by.stage, pair.labelled_by.take, pair.labelled_by.pair) == ("PRE", 1, None)
    assert [flag.code for flag in pair.measurement.flags] == ["image-dark"]
    assert set(pair.poses) == {"L1", "T11", "T9"}


def test_certain_labels_are_left_as_they_are_and_wait_for_nothing() -> None:
    whole = showing(*LABELS)
    (pair,) = label_pairs([whole], REQUEST, work(unended_job="job"))
    assert pair.measurement is whole
    assert pair.labelled_by is None


def test_uncertain_labels_wait_for_an_earlier_stage_that_has_not_ended() -> None:
    with pytest.raises(NotReadyError) as raised:
        label_pairs([showing("L1", "T11", "T9")], REQUEST, work(unended_job="the-job"))
    assert raised.value.job_id == "the-job"


def test_one_triad_alone_cannot_be_decided_by_distances_and_waits_for_nothing() -> None:
    (pair,) = label_pairs([showing("T9")], REQUEST, work(unended_job="the-job"))
    assert labels(pair.measurement) == [None]


def test_without_an_earlier_stage_labels_stay_uncertain() -> None:
    (pair,) = label_pairs([showing("L1", "T11", "T9")], REQUEST, work())
    assert labels(pair.measurement) == [None] * 3
    assert pair.labelled_by is None


def test_a_stage_that_decides_nothing_is_not_named() -> None:
    even = LabelledStage("PRE", 1, {label: pose(50.0 * k) for k, label in enumerate(LABELS)})
    (pair,) = label_pairs([showing("L1", "T11", "T9")], REQUEST, work(even))
    assert labels(pair.measurement) == [None] * 3
    assert pair.labelled_by is None
    assert "labels-uncertain" in {flag.code for flag in pair.measurement.flags}


def test_a_whole_pair_of_the_burst_goes_before_any_earlier_stage() -> None:
    pairs = label_pairs([showing("T11", "T9", "T7"), showing(*LABELS)], REQUEST, work(unended_job="job"))
    assert [labels(pair.measurement) for pair in pairs] == [["T11", "T9", "T7"], list(LABELS)]
    assert pairs[0].labelled_by is not None
    assert (pairs[0].labelled_by.stage, pairs[0].labelled_by.take, pairs[0].labelled_by.pair) == (
        "POST",
        2,
        2,
    )
    assert pairs[1].labelled_by is None
