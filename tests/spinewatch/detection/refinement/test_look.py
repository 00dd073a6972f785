"""Which looks are usual: what the networks agree on, and how certain they are."""

import numpy as np
import pytest

from spinewatch.detection.refinement.look import Look, LookParameters, is_usual

P = LookParameters()


def look(seen_by_both: int, seen_by_first: int = 0, seen_by_second: int = 0, sd: float = 0.02) -> Look:
    """Return a view with balls that both networks or one of them sees, and eight places without a ball."""
    counts = (seen_by_both, seen_by_first, seen_by_second, 8)
    first, second = (
        np.repeat(seen, counts) for seen in ((True, True, False, False), (True, False, True, False))
    )
    return Look(first, second, np.full(len(first), sd))


@pytest.mark.parametrize(
    ("views", "usual"),
    [
        ((look(12), look(12)), True),
        ((look(12, 1), look(12, 0, 1)), True),
        ((look(12, 4), look(12, 1)), False),
        ((look(12), look(12, 0, 5)), False),
        ((look(12, sd=0.05), look(12, sd=0.05)), False),
        ((look(12, sd=0.05), look(14)), True),
        ((look(3), look(3)), False),
        ((look(0), look(0)), False),
        ((look(24),), True),
    ],
)
def test_a_look_is_usual_when_networks_agree_and_are_certain(views: tuple[Look, ...], usual: bool) -> None:
    assert is_usual(views, P) is usual


def test_places_that_no_network_takes_for_a_ball_do_not_count() -> None:
    one = look(12)
    other = Look(one.first, one.second, np.where(one.first, one.sd, 9.0))
    assert is_usual([one, other], P)
