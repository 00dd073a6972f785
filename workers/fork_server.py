"""A prepared process from which others are forked: they start in milliseconds, with everything imported.

It is forked from the worker before that has threads or a database, and has one thread itself: a process with threads
cannot be forked safely.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from struct import Struct
from typing import NoReturn

_NUMBER = Struct("<q")
_FORK = 0
_PR_SET_PDEATHSIG = 1


class ForkServerEndedError(Exception):
    """The prepared process has ended: the worker must end too, and be started again."""


@dataclass(frozen=True)
class Forked:
    """A forked process.

    Attributes
    ----------
    pid
        Its number, which is not used again before `ForkServer.wait`.
    connection
        Connection to it.
    """

    pid: int
    connection: Connection

    def kill(self) -> None:
        """End the process at once."""
        os.kill(self.pid, signal.SIGKILL)


class ForkServer:
    """A process that forks others; all of them end with the process that made it.

    Parameters
    ----------
    target
        What a forked process does with its connection to this process.
    """

    def __init__(self, target: Callable[[Connection], None]) -> None:
        self._socket, theirs = socket.socketpair()
        parent = os.getpid()
        if os.fork() == 0:
            self._socket.close()
            _run_and_exit(lambda: _serve(theirs, parent, target))
        theirs.close()

    def fork(self) -> Forked:
        """Start a process.

        Returns
        -------
        Forked
            The process.

        Raises
        ------
        ForkServerEndedError
            The prepared process has ended.
        """
        ours, theirs = socket.socketpair()
        try:
            socket.send_fds(self._socket, [_NUMBER.pack(_FORK)], [theirs.fileno()])
        except OSError as error:
            ours.close()
            raise ForkServerEndedError from error
        finally:
            theirs.close()
        return Forked(self._answer(), Connection(ours.detach()))

    def wait(self, process: Forked) -> int:
        """Wait for the end of a process.

        Parameters
        ----------
        process
            The process; its connection is closed.

        Returns
        -------
        int
            Its exit status, or the negative number of the signal that ended it.

        Raises
        ------
        ForkServerEndedError
            The prepared process has ended.
        """
        process.connection.close()
        try:
            self._socket.sendall(_NUMBER.pack(process.pid))
        except OSError as error:
            raise ForkServerEndedError from error
        return self._answer()

    def close(self) -> None:
        """End the prepared process."""
        self._socket.close()

    def _answer(self) -> int:
        try:
            answer = self._socket.recv(_NUMBER.size, socket.MSG_WAITALL)
        except OSError as error:
            raise ForkServerEndedError from error
        if len(answer) < _NUMBER.size:
            raise ForkServerEndedError
        return int(_NUMBER.unpack(answer)[0])


def _serve(requests: socket.socket, parent: int, target: Callable[[Connection], None]) -> None:
    _end_with(parent)
    for number in (signal.SIGINT, signal.SIGTERM):  # the worker decides when its processes end
        signal.signal(number, signal.SIG_IGN)
    gc.collect()
    gc.freeze()  # pages that are never written stay shared
    while True:
        request, files, _, _ = socket.recv_fds(requests, _NUMBER.size, 1)
        if len(request) < _NUMBER.size:
            return
        (pid,) = _NUMBER.unpack(request)
        if pid != _FORK:
            _, status = os.waitpid(pid, 0)
            requests.sendall(_NUMBER.pack(os.waitstatus_to_exitcode(status)))
            continue
        (file,) = files
        server, child = os.getpid(), os.fork()
        if child == 0:
            requests.close()
            _run_and_exit(partial(_start, server, file, target))
        os.close(file)
        requests.sendall(_NUMBER.pack(child))


def _start(server: int, file: int, target: Callable[[Connection], None]) -> None:
    _end_with(server)
    target(Connection(file))


def _run_and_exit(action: Callable[[], None]) -> NoReturn:
    """Run what a forked process is for, and end it without what its parent does at its own end."""
    try:
        action()
    except BaseException:
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)


def _end_with(parent: int) -> None:
    """Have Linux kill this process when its parent ends, in whatever way."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)
