import threading

from workers.periodic import start_periodic


def test_an_action_is_repeated_although_it_fails_until_it_is_stopped() -> None:
    stop, third = threading.Event(), threading.Event()
    rounds: list[str] = []

    def action() -> None:
        rounds.append(threading.current_thread().name)
        if len(rounds) == 3:
            third.set()
        raise RuntimeError("the database is busy")

    start_periodic("sweep", 0.01, stop, action)
    assert third.wait(20)
    stop.set()
    for thread in threading.enumerate():
        if thread.name == "sweep":
            thread.join(20)
            assert not thread.is_alive()
    assert set(rounds) == {"sweep"}
