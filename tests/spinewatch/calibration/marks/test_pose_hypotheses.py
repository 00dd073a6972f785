from itertools import islice

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.marks.assignment import IdentificationTask, MarkIdentificationParameters
from spinewatch.calibration.marks.pose_hypotheses import pose_hypotheses, seed_triples
from tests.spinewatch.calibration.simulated import FIELD, SENSOR, TABLE_3_3, TYPICAL, moved_board

PARAMETERS = MarkIdentificationParameters()
seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(8, 30))
def test_seeds_are_neighbours_that_are_not_collinear_from_the_centre_outwards(seed: int, n: int) -> None:
    pixels = np.random.default_rng(seed).uniform(0, 400, (n, 2))
    triples = list(islice(seed_triples(pixels), 5))
    centre = np.median(pixels, axis=0)
    distances = [np.linalg.norm(pixels[t[0]] - centre) for t in triples]
    assert distances == sorted(distances)
    for first, second, third in triples:
        a, b = pixels[second] - pixels[first], pixels[third] - pixels[first]
        sine = (a[0] * b[1] - a[1] * b[0]) / (np.linalg.norm(a) * np.linalg.norm(b))
        assert abs(sine) > PARAMETERS.min_seed_sine
        near = np.argsort(np.linalg.norm(pixels - pixels[first], axis=1))[1:6]
        assert {second, third} <= set(near.tolist())


def test_the_true_pose_is_among_the_best_hypotheses_of_the_true_lens() -> None:
    for seed in range(5):
        camera, placement = TABLE_3_3.left, moved_board(seed, tilt_deg=6.0)
        X = FIELD.take(TYPICAL)
        task = IdentificationTask(camera.project(placement(X)), FIELD, SENSOR.image_size_px[0], PARAMETERS)
        found = [
            h
            for triple in islice(seed_triples(task.pixels), 3)
            for h in pose_hypotheses(task, triple, camera)
        ]
        best = min(found, key=lambda h: np.abs(h.camera.project(X) - task.pixels).max())
        assert np.abs(best.camera.project(X) - task.pixels).max() < 5.0
        assert best.score > 0.9 * len(TYPICAL)


def test_scores_decrease_and_their_number_is_limited() -> None:
    task = IdentificationTask(
        TABLE_3_3.left.project(FIELD.take(TYPICAL)), FIELD, SENSOR.image_size_px[0], PARAMETERS
    )
    scores = [h.score for h in pose_hypotheses(task, next(seed_triples(task.pixels)), TABLE_3_3.left)]
    assert scores == sorted(scores, reverse=True)
    assert 0 < len(scores) <= PARAMETERS.max_hypotheses
