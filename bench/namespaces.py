"""Hosts of their own on one machine: network namespaces on a bridge, that can be cut off, slowed and killed."""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

_CLONE_NEWNET = 0x40000000
_NET = "10.99.0"
IP = shutil.which("ip") or "ip"
_ON_S, _OFF_S = 0.3, 0.15


class Host:
    """A host with an address on the network."""

    def __init__(self, network: Network, name: str, number: int) -> None:
        self.name = name
        self.address = f"{_NET}.{number}"
        self.namespace = f"{network.prefix}-{name}"
        self._port = f"p{number}"  # its end of the cable at the bridge
        self._network = network
        self._processes: list[subprocess.Popen[bytes]] = []
        self._shaker: threading.Thread | None = None
        self._loose: threading.Event | None = None
        _ip("netns", "add", self.namespace)
        _ip(
            "-n",
            network.bridge,
            "link",
            "add",
            self._port,
            "type",
            "veth",
            "peer",
            "name",
            "eth0",
            "netns",
            self.namespace,
        )
        _ip("-n", network.bridge, "link", "set", self._port, "master", "br0", "up")
        _ip("-n", self.namespace, "address", "add", f"{self.address}/24", "dev", "eth0")
        for device in ("lo", "eth0"):
            _ip("-n", self.namespace, "link", "set", device, "up")

    def start(
        self, command: Sequence[str], environment: Mapping[str, str], log: Path
    ) -> subprocess.Popen[bytes]:
        """Start a process on this host."""
        with log.open("ab") as file:
            process = subprocess.Popen(
                [IP, "netns", "exec", self.namespace, *command],
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
                start_new_session=True,
            )
        self._processes.append(process)
        return process

    def cut(self) -> None:
        """Pull the cable: nothing arrives, and nobody is told."""
        _ip("-n", self._network.bridge, "link", "set", self._port, "down")

    def join(self) -> None:
        """Plug the cable in again."""
        _ip("-n", self._network.bridge, "link", "set", self._port, "up")

    def slow(self) -> str:
        """Delay and lose packets to and from this host; return how: by tc-netem, or by a loose cable without it."""
        rule = ("netem", "delay", "100ms", "50ms", "loss", "3%")
        try:
            for namespace, device in self._ends():
                _run("ip", "netns", "exec", namespace, "tc", "qdisc", "replace", "dev", device, "root", *rule)
        except subprocess.CalledProcessError:  # this kernel has no netem
            self._loose = threading.Event()
            self._shaker = threading.Thread(target=self._shake, args=(self._loose,), daemon=True)
            self._shaker.start()
            return f"cable loose: off {_OFF_S} s, on {_ON_S} s"
        return " ".join(rule)

    def fast(self) -> None:
        """End what ``slow`` began."""
        if self._shaker is not None and self._loose is not None:
            self._loose.set()
            self._shaker.join()
            self._shaker = None
            self.join()
            return
        for namespace, device in self._ends():
            _run("ip", "netns", "exec", namespace, "tc", "qdisc", "del", "dev", device, "root")

    def _shake(self, stop: threading.Event) -> None:
        while not stop.wait(_ON_S):
            self.cut()
            time.sleep(_OFF_S)
            self.join()

    def kill(self) -> None:
        """End every process on this host with SIGKILL, as when its power fails: no connection is closed."""
        self.cut()
        for process in self._processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        for pid in _pids(self.namespace):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self._processes.clear()

    def running(self) -> list[bool]:
        """Return of each process that was started whether it still runs."""
        return [process.poll() is None for process in self._processes]

    def remove(self) -> None:
        """End its processes and take it off the network."""
        self.kill()
        _ip("netns", "delete", self.namespace)

    def _ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        return (self.namespace, "eth0"), (self._network.bridge, self._port)


class Network:
    """A bridge that hosts are on; the hosts and the bridge are gone after the block."""

    def __init__(self) -> None:
        self.prefix = f"sw{os.getpid()}"
        self.bridge = f"{self.prefix}-bridge"
        self._hosts: list[Host] = []
        self._home: int | None = None

    def __enter__(self) -> Network:
        _ip("netns", "add", self.bridge)
        _ip("-n", self.bridge, "link", "add", "br0", "type", "bridge")
        _ip("-n", self.bridge, "link", "set", "br0", "up")
        return self

    def __exit__(self, *_: object) -> None:
        self.leave()
        for host in self._hosts:
            host.remove()
        _ip("netns", "delete", self.bridge)

    def host(self, name: str) -> Host:
        """Add a host."""
        host = Host(self, name, len(self._hosts) + 2)
        self._hosts.append(host)
        return host

    def enter(self, host: Host) -> None:
        """Open the connections of this process, from now on, on a host."""
        self._home = os.open("/proc/self/ns/net", os.O_RDONLY)
        there = os.open(f"/var/run/netns/{host.namespace}", os.O_RDONLY)
        _set_namespace(there)
        os.close(there)

    def leave(self) -> None:
        """Return to where ``enter`` was called."""
        if self._home is not None:
            _set_namespace(self._home)
            os.close(self._home)
            self._home = None


def reason_against() -> str | None:
    """Return why there can be no network namespaces here, None if there can."""
    if os.geteuid() != 0:
        return "making network namespaces needs root"
    name = f"swprobe{os.getpid()}"
    for command in (("ip", "netns", "add", name), ("ip", "netns", "delete", name)):
        try:
            _run(*command)
        except (OSError, subprocess.CalledProcessError) as error:
            output: Any = getattr(error, "stderr", None) or str(error)
            text = output.decode() if isinstance(output, bytes) else output
            return f"network namespaces cannot be made here: {text.strip()}"
    return None


def _pids(namespace: str) -> list[int]:
    found = subprocess.run([IP, "netns", "pids", namespace], capture_output=True, text=True, check=False)
    return [int(word) for word in found.stdout.split()]


def _ip(*words: str) -> None:
    _run("ip", *words)


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)


def _set_namespace(descriptor: int) -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.setns(descriptor, _CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), "the network namespace cannot be entered")
