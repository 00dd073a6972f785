"""The published method as a method of measurement, on an image whose balls its templates were made of."""

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.errors import ImageSizeError, ParameterError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.markers import FLAT_10_14_18, orthogonal_triad
from spinewatch.pipeline_1995 import METHOD, PublishedMeasurer, PublishedParameters
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.stage import StageRequest
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters
from spinewatch.triads.known_configuration import KnownConfiguration
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
RIG = parse_rig((D1 / "rig.json").read_bytes())
FRAMES = tuple(
    Frame(decode_image((D1 / "INTER" / f"{side}.png").read_bytes()), side) for side in ("left", "right")
)
LEFT, RIGHT = FRAMES
P = PublishedParameters()
WHOLE = replace(
    P,
    detection=replace(P.detection, preprocessing=PreprocessingParameters(statistic=None)),
    sets=replace(P.sets, refine=False),
)
LABELS = ("L1", "T11", "T9", "T7")
TRUE_MM = np.array([[363.5, 388.1, 71.7], [414.4, 386.4, 76.5], [471.8, 376.5, 85.4], [517.9, 374.7, 83.4]])


@pytest.fixture(scope="module")
def measurer() -> PublishedMeasurer:
    return PublishedMeasurer(RIG, WHOLE)


def test_triads_that_pass_have_poses_within_their_deviations(measurer: PublishedMeasurer) -> None:
    measured = measurer.measure(LEFT, RIGHT, StageRequest(LABELS, "x"), explained=True)
    assert measured.triads
    for labelled in measured.triads:
        pose = labelled.triad.pose
        assert pose is not None
        off = np.abs(TRUE_MM - pose.position_mm)
        nearest = off[off.sum(axis=1).argmin()]
        assert np.all(nearest < 4 * pose.position_sd_mm + 0.1)
        assert 0.1 < pose.position_sd_mm.max() < 2
    assert measured.templates_version.startswith("thesis-1995-")
    assert isinstance(measured.parameters, PublishedParameters)
    assert measured.parameters.method == METHOD
    assert measured.explanation is not None
    assert measured.explanation.method == METHOD


def test_without_all_triads_there_are_no_labels_but_the_reason(measurer: PublishedMeasurer) -> None:
    measured = measurer.measure(LEFT, RIGHT, StageRequest(LABELS, "x"))
    assert 0 < len(measured.triads) < len(LABELS)
    assert {triad.label for triad in measured.triads} == {None}
    assert all("H5" in (triad.label_reason or "") for triad in measured.triads)
    assert {"triad-count-low", "labels-uncertain"} <= {flag.code for flag in measured.flags}


def test_as_many_triads_as_labels_are_labelled_by_order(measurer: PublishedMeasurer) -> None:
    found = len(measurer.measure(LEFT, RIGHT, StageRequest()).triads)
    labels = ("T12", "T10", "T8", "T6")[:found]
    measured = measurer.measure(LEFT, RIGHT, StageRequest(labels, "x"))
    assert [triad.label for triad in measured.triads] == list(labels)
    x = [triad.triad.position_mm[0] for triad in measured.triads]
    assert x == sorted(x)


@pytest.mark.parametrize(("triads", "features"), [(None, 15), (4, 15), (8, 30)])
def test_the_number_of_triads_is_that_of_expected_features(
    measurer: PublishedMeasurer, triads: int | None, features: int
) -> None:
    steps = measurer.steps(LEFT, RIGHT, StageRequest(triads=triads))
    assert steps.parameters.detection.expected_features == features


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (StageRequest(models=(FLAT_10_14_18, FLAT_10_14_18)), "one kind of marker"),
        (StageRequest(models=(orthogonal_triad(18, 14, 10),)), "does not know the marker"),
        (StageRequest(known=KnownConfiguration()), "labels by order"),
    ],
)
def test_what_the_method_does_not_know_is_refused(
    measurer: PublishedMeasurer, request_: StageRequest, words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        measurer.measure(LEFT, RIGHT, request_)


def test_images_are_checked(measurer: PublishedMeasurer) -> None:
    with pytest.raises(SameImageError):
        measurer.measure(LEFT, LEFT, StageRequest())
    small = Frame(RIGHT.pixels[:100, :100], "right")
    with pytest.raises(ImageSizeError):
        measurer.measure(LEFT, small, StageRequest())


def test_a_blank_image_has_no_features(measurer: PublishedMeasurer) -> None:
    blank = Frame(np.full_like(RIGHT.pixels, 90), "right")
    measured = measurer.measure(LEFT, blank, StageRequest(triads=4))
    assert not measured.triads
    assert "no-features" in {flag.code for flag in measured.flags}
