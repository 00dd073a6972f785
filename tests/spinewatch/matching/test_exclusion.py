import numpy as np

from spinewatch.detection.features import HIDDEN, Features
from spinewatch.matching.exclusion import NEAR_MM, RemovedTriad, removed_candidates
from spinewatch.matching.triad_candidates import TriadCandidates

CENTRES = np.arange(12.0).reshape(6, 2)


def features(*manual: int) -> Features:
    placed = np.isin(np.arange(6), manual)
    return Features(CENTRES, np.ones(6), np.tile(np.eye(2), (6, 1, 1)), None, placed)


def candidate(left: list[int], right: list[int], x_mm: float = 500.0) -> TriadCandidates:
    index = [np.array([[*side, *[HIDDEN] * (4 - len(side))]]) for side in (left, right)]
    return TriadCandidates(
        np.zeros(1, dtype=np.intp), np.array([[x_mm, 0, 0]]), np.eye(3)[None], np.zeros(1), *index
    )


REMOVED = RemovedTriad(np.zeros(3), CENTRES[:3], CENTRES[:3])


def is_removed(found: TriadCandidates, *manual: int) -> bool:
    return bool(removed_candidates(found, features(*manual), features(*manual), [REMOVED])[0])


def test_a_triad_of_the_same_images_is_not_found_again() -> None:
    assert is_removed(candidate([0, 1, 2], [0, 1, 2]))
    assert is_removed(candidate([0, 1], [0, 1]))
    assert is_removed(candidate([0, 1, 2], [0, 1, 2]), 0)


def test_one_of_mostly_the_same_images_needs_a_centre_of_a_person() -> None:
    assert is_removed(candidate([0, 1, 4], [0, 1, 4]))
    assert not is_removed(candidate([0, 1, 4], [0, 1, 4]), 4)
    assert not is_removed(candidate([0, 4, 5], [0, 4, 5]))


def test_one_at_the_same_place_needs_a_centre_of_a_person() -> None:
    assert is_removed(candidate([3, 4, 5], [3, 4, 5], 0.9 * NEAR_MM))
    assert not is_removed(candidate([3, 4, 5], [3, 4, 5], 0.9 * NEAR_MM), 5)
    assert not is_removed(candidate([3, 4, 5], [3, 4, 5], 1.1 * NEAR_MM))
