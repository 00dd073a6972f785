"""How long a request keeps others from an answer, in CPU time of the API: no matter how busy the machine is."""

from __future__ import annotations

import math
import threading
import time
from contextlib import closing
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from types import TracebackType

from tests.http.harness import Service

_PAUSE_S = 0.002
_STEP_S = 0.01
"""CPU time of the API after which it is asked again, so that the questions cost little and long work is met soon."""
_CPU_OF_PROCESS = 2
"""Kind of a clock, clock_getcpuclockid(3): that of all threads of a process."""


def cpu_clock_s(pid: int) -> float:
    """Return the CPU time that all threads of a process have used."""
    return time.clock_gettime((~pid << 3) | _CPU_OF_PROCESS)


class Liveness:
    """A client that asks for /health/live again and again while the API works and a context lasts.

    ``delay_s`` is the largest CPU time until an answer, ``cost_s`` what the answers themselves cost at least.

    Parameters
    ----------
    service
        The service.
    """

    def __init__(self, service: Service) -> None:
        self.delay_s = 0.0
        self._least_s, self._answers = math.inf, 0
        self._pid = service.server.pid
        self._address = ("127.0.0.1", service.port)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._failed: Exception | None = None

    @property
    def cost_s(self) -> float:
        """CPU time of all answers, as if each had cost as little as the cheapest one."""
        return self._answers * self._least_s if self._answers else 0.0

    def __enter__(self) -> Liveness:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        self._thread.join()
        if self._failed is not None and error is None:
            raise self._failed

    def _ask(self) -> None:
        try:
            with closing(HTTPConnection(*self._address, timeout=60.0)) as connection:
                last_s = -math.inf
                while not self._end.is_set():
                    if cpu_clock_s(self._pid) - last_s >= _STEP_S:
                        last_s = self._answer(connection)
                    self._end.wait(_PAUSE_S)
        except (OSError, HTTPException, AssertionError) as failed:
            self._failed = failed

    def _answer(self, connection: HTTPConnection) -> float:
        """Ask once; return the CPU time that the API has used until then."""
        before = cpu_clock_s(self._pid)
        connection.request("GET", "/health/live")
        answer = connection.getresponse()
        answer.read()
        after = cpu_clock_s(self._pid)
        assert answer.status == HTTPStatus.OK
        self.delay_s, self._least_s = max(self.delay_s, after - before), min(self._least_s, after - before)
        self._answers += 1
        return after
