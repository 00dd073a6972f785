import numpy as np
import pytest

from spinewatch.geometry.triangulation import triangulate
from spinewatch.markers import FLAT_10_14_18, flat_triad
from spinewatch.planning.accuracy import straight_chain
from spinewatch.planning.marker_ambiguity import marker_ambiguity
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.triads.pose import ball_centres

RIG = planned_rig()
CHAIN = straight_chain(("T9", "T8"), np.zeros(3), 50.0)


def test_the_deviation_of_the_difference_is_the_spread_of_simulated_measurements() -> None:
    rng = np.random.default_rng(0)
    balls = ball_centres(CHAIN[:1], FLAT_10_14_18)[0]
    repeated = np.tile(balls, (4000, 1))
    rays = []
    for camera in (RIG.left, RIG.right):
        noisy = camera.project(repeated) + 0.1 * rng.standard_normal((len(repeated), 2))
        rays.append(camera.rays(noisy, 0.01 * np.eye(2)))
    found = triangulate(rays).position_mm.reshape(4000, 3, 3)
    a, b = FLAT_10_14_18.pairs.T
    distances = np.sort(np.linalg.norm(found[:, a] - found[:, b], axis=-1), axis=1)
    expected = marker_ambiguity(RIG, FLAT_10_14_18, CHAIN[:1], 0.1)
    differences = np.diff(np.sort(FLAT_10_14_18.distances_mm))
    least = int(np.argmin(differences))
    spread = np.std(distances[:, least + 1] - distances[:, least])
    assert expected.difference_mm == pytest.approx(differences[least])
    assert spread == pytest.approx(expected.difference_sd_mm, rel=0.05)


def test_one_vertebra_has_no_neighbour() -> None:
    assert np.isnan(marker_ambiguity(RIG, FLAT_10_14_18, CHAIN[:1], 0.1).neighbour_mm)


def test_a_neighbour_at_the_distance_of_a_leg_makes_a_wrong_triplet() -> None:
    near = straight_chain(("T9", "T8"), np.zeros(3), float(FLAT_10_14_18.distances_mm[1]))
    assert marker_ambiguity(RIG, FLAT_10_14_18, near, 0.1).neighbour_mm == pytest.approx(0, abs=1e-9)
    far = straight_chain(("T9", "T8"), np.zeros(3), 100.0)
    assert marker_ambiguity(RIG, FLAT_10_14_18, far, 0.1).neighbour_mm > 20


def test_legs_of_nearly_equal_distances_are_more_ambiguous() -> None:
    alike = marker_ambiguity(RIG, flat_triad(15.0, 14.0, 13.0), CHAIN, 0.1)
    assert alike.difference_mm < marker_ambiguity(RIG, FLAT_10_14_18, CHAIN, 0.1).difference_mm
