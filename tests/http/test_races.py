"""Carts that send at the same moment: one wins, the others are told, and nobody sees an error of the service."""

import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import httpx
import numpy as np

from tests.http.harness import Pair, Service, code_of
from tests.http.test_stages import encoded

CARTS = 12


def pairs() -> list[Pair]:
    """Return one pair of the sample's size per cart, each of its own."""
    random = np.random.default_rng(7)
    images = random.integers(0, 256, (2 * CARTS, 416, 568), np.uint8)
    return [
        (encoded(left, "PNG"), encoded(right, "PNG"))
        for left, right in zip(images[::2], images[1::2], strict=True)
    ]


def together(service: Service, surgeries: list[str], names: list[str]) -> list[httpx.Response]:
    """Send one stage per cart at the same moment."""
    calibration = service.calibration()
    start = threading.Barrier(CARTS)
    images = pairs()

    def cart(number: int) -> httpx.Response:
        start.wait()
        return service.send(surgeries[number], names[number], images[number], calibration)

    with ThreadPoolExecutor(CARTS) as pool:
        return list(pool.map(cart, range(CARTS)))


def test_of_carts_that_race_for_one_name_one_wins(idle: Service) -> None:
    surgery = idle.surgery()
    answers = together(idle, [surgery] * CARTS, ["PRE"] * CARTS)
    assert Counter(answer.status_code for answer in answers) == {202: 1, 409: CARTS - 1}
    assert {code_of(answer, 409) for answer in answers if answer.status_code == 409} == {"stage-exists"}
    assert idle.sql("SELECT count(*) FROM stages WHERE surgery_id = ?", surgery) == [(1,)]


def test_carts_with_names_of_their_own_all_win(idle: Service) -> None:
    surgery = idle.surgery()
    answers = together(idle, [surgery] * CARTS, [f"S{number}" for number in range(CARTS)])
    assert [answer.status_code for answer in answers] == [202] * CARTS
    query = "SELECT count(*), count(DISTINCT s.name) FROM stages s JOIN jobs j ON j.subject_id = s.id"
    assert idle.sql(f"{query} WHERE s.surgery_id = ?", surgery) == [(CARTS, CARTS)]
