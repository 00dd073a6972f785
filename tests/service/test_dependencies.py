import structlog

from service.dependencies import enqueue, problems
from store.queue import JobQueue


class BrokenQueue(JobQueue):
    def __init__(self) -> None: ...

    def enqueue(self, job_id: str) -> None:
        raise OSError("disk full")


def test_a_job_that_cannot_be_enqueued_is_logged_and_accepted() -> None:
    with structlog.testing.capture_logs() as lines:
        enqueue(BrokenQueue(), "j1")
    assert [(line["event"], line["job_id"]) for line in lines] == [("job_not_enqueued", "j1")]


def test_every_route_declares_the_problems_that_any_route_has() -> None:
    assert set(problems(404)) == {404, 500, 503}
    assert problems(415)[415]["description"] == "Unsupported media type"
