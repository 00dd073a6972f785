"""``python -m bench.hosts``: API, two worker hosts, database and queue on hosts of their own, of which some fail.

The hosts are network namespaces on this machine. While a cart sends stages without pause, a host is cut off and comes
back, is killed, or is slow; then everything heals, and the database is asked: every stage that was accepted must have
one job, one result and one event of its measurement, and all results of the same pair must be the same.
``--check`` ends with status 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

import httpx
import psycopg

from bench.namespaces import IP, Host, Network, reason_against
from bench.tables import Bar, Grid, bars

SAMPLE = Path(__file__).parents[1] / "samples" / "D1"
PATIENCE_S = 120.0
CUT_S = 15.0
BEATS_S = 1.0
_MAX_ATTEMPTS = "20"


@dataclass
class Outcome:
    """What an experiment did to the record.

    ``sent`` counts the stages that were accepted, ``refused`` the answers 503, ``unreachable`` the requests without an
    answer, ``broken`` any other answer; ``ended_s`` is the time from the end of the fault to the end of the last job.
    """

    name: str
    sent: int = 0
    refused: int = 0
    unreachable: int = 0
    broken: int = 0
    lost: int = 0
    doubled: int = 0
    differing: int = 0
    started_again: int = 0
    restarted: bool = False
    ended_s: float = 0.0
    notes: list[str] = field(default_factory=list)


class Site:
    """Six hosts with Spinewatch on them."""

    def __init__(self, network: Network, folder: Path) -> None:
        self.folder = folder
        self.database = network.host("database")
        self.queue = network.host("queue")
        self.api = network.host("api")
        self.workers = [network.host("worker-1"), network.host("worker-2")]
        self.cart = network.host("cart")
        self._data = folder / "postgresql"
        self.url = f"http://{self.api.address}:8000"
        self.dsn = f"postgresql://spinewatch@{self.database.address}/postgres"
        self._environment = {
            "SPINEWATCH_DATABASE_URL": self.dsn,
            "SPINEWATCH_QUEUE_URL": f"redis://{self.queue.address}:6379/0",
            "SPINEWATCH_MAX_ATTEMPTS": _MAX_ATTEMPTS,
            "OPENBLAS_NUM_THREADS": "1",
        }

    def start(self) -> str:
        """Start everything; return an API key."""
        self._make_cluster()
        self.start_database()
        self.start_queue()
        _wait(self._database_answers, "the database")
        self._once("db", "upgrade")
        scopes = ("capture:write", "stage:read", "correct:write", "admin")
        key = self._once("key", "create", "cart", *(word for scope in scopes for word in ("--scope", scope)))
        self.start_api()
        for host in self.workers:
            self.start_worker(host)
        return key.split()[-1]

    def start_database(self) -> None:
        """Start the database server."""
        postgres = [str(_server_programs() / "postgres"), "-D", str(self._data), "-c", "fsync=on"]
        listen = [
            "-c",
            f"listen_addresses={self.database.address}",
            "-c",
            f"unix_socket_directories={self._data}",
        ]
        self.database.start([*_as_postgres(), *postgres, *listen], {}, self.folder / "postgresql.log")

    def start_queue(self) -> None:
        """Start the queue server, empty."""
        options = ["--bind", self.queue.address, "--protected-mode", "no", "--save", "", "--appendonly", "no"]
        self.queue.start(["redis-server", *options], {}, self.folder / "redis.log")

    def start_api(self) -> None:
        """Start the API."""
        self._start(self.api, "serve", "--host", self.api.address, "--behind-proxy")

    def start_worker(self, host: Host) -> None:
        """Start a worker on a host."""
        self._start(host, "worker")

    def wait_until_busy(self, host: Host) -> None:
        """Wait until a worker host has a job in hand; any other host is always busy."""
        if host in self.workers:
            _wait(lambda: self._has_job(host), "a job on the host")

    def _has_job(self, host: Host) -> bool:
        lines = (self.folder / f"{host.name}.log").read_text(encoding="utf-8").splitlines()
        jobs = [line for line in lines if " job_" in line]
        return bool(jobs) and " job_started " in jobs[-1]

    def _start(self, host: Host, *words: str) -> None:
        command = [sys.executable, "-m", "commands", *words]
        host.start(command, self._environment, self.folder / f"{host.name}.log")

    def _once(self, *words: str) -> str:
        ended = subprocess.run(
            [IP, "netns", "exec", self.api.namespace, sys.executable, "-m", "commands", *words],
            env={**os.environ, **self._environment},
            capture_output=True,
            text=True,
            check=False,
        )
        if ended.returncode != 0:
            raise RuntimeError(f"spinewatch {' '.join(words)}: {ended.stderr}")
        return ended.stdout

    def _make_cluster(self) -> None:
        self._data.mkdir()
        if os.geteuid() == 0:
            shutil.chown(self._data, "postgres")
        initialize = [
            str(_server_programs() / "initdb"),
            "-D",
            str(self._data),
            "-U",
            "spinewatch",
            "--auth=trust",
        ]
        subprocess.run([*_as_postgres(), *initialize], check=True, capture_output=True)
        with (self._data / "pg_hba.conf").open("a") as rules:
            rules.write("host all all 10.99.0.0/24 trust\n")

    def _database_answers(self) -> bool:
        try:
            psycopg.connect(self.dsn, connect_timeout=2).close()
        except psycopg.OperationalError:
            return False
        return True


class Cart:
    """Sends stages of one surgery without pause, each until it is accepted."""

    def __init__(self, site: Site, key: str, outcome: Outcome) -> None:
        self.names: list[str] = []
        self._outcome = outcome
        self._client = httpx.Client(
            base_url=site.url, headers={"Authorization": f"Bearer {key}"}, timeout=10, trust_env=False
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._send_all, daemon=True)
        rig = json.loads((SAMPLE / "rig.json").read_text())
        self._calibration = self._post("/v1/calibrations", json=rig)["id"]
        surgery = {
            "reference": f"case-{uuid4().int % 10**12}",
            "vertebrae": ["L1", "T11", "T9", "T7"],
            "reference_vertebra": "L1",
            "spine_axis": "x",
        }
        self.surgery: str = self._post("/v1/surgeries", json=surgery)["id"]
        self._images = {side: (SAMPLE / "PRE" / f"{side}.png").read_bytes() for side in ("left", "right")}

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wait(self, stages: int) -> None:
        """Wait until that number of further stages is accepted."""
        until = len(self.names) + stages
        _wait(lambda: len(self.names) >= until, f"{stages} more stages")

    def stop(self) -> None:
        """End with the stage that is being sent."""
        self._stop.set()
        self._thread.join()
        self._client.close()

    def _post(self, path: str, **content: Any) -> Any:
        def attempt() -> Any:
            try:
                answer = self._client.post(path, **content)
            except httpx.TransportError:
                return None
            return answer.json() if answer.status_code == 201 else None

        return _wait(attempt, f"POST {path}")

    def _send_all(self) -> None:
        number = 0
        while not self._stop.is_set():
            name = f"S{number:04d}"
            if self._send(name):
                self.names.append(name)
                number += 1
            else:
                time.sleep(0.2)
            time.sleep(0.3)  # about as fast as two workers measure on two cores

    def _send(self, name: str) -> bool:
        """Return whether a stage is accepted, now or by an earlier request whose answer was lost."""
        try:
            answer = self._client.post(
                f"/v1/surgeries/{self.surgery}/stages",
                data={"name": name, "calibration_id": self._calibration},
                files={side: (f"{side}.png", content) for side, content in self._images.items()},
            )
        except httpx.TransportError:
            self._outcome.unreachable += 1
            return False
        if answer.status_code in {200, 202, 409}:
            return True
        if answer.status_code == 503:
            self._outcome.refused += 1
        else:
            self._outcome.broken += 1
            self._outcome.notes.append(f"{answer.status_code}: {answer.text[:200]}")
        return False


Fault = Callable[[Site], str | None]
"""What fails and heals; it may return how."""


def _nothing(_: Site) -> None:
    time.sleep(BEATS_S)


def _cut(choose: Callable[[Site], Host]) -> Fault:
    def fault(site: Site) -> None:
        site.wait_until_busy(choose(site))
        choose(site).cut()
        time.sleep(CUT_S)
        choose(site).join()

    return fault


def _killed(choose: Callable[[Site], Host], again: Callable[[Site], None], seconds: float = 5.0) -> Fault:
    def fault(site: Site) -> None:
        site.wait_until_busy(choose(site))
        choose(site).kill()
        time.sleep(seconds)
        choose(site).join()
        again(site)

    return fault


def _slow(choose: Callable[[Site], Host]) -> Fault:
    def fault(site: Site) -> str:
        how = choose(site).slow()
        time.sleep(CUT_S)
        choose(site).fast()
        return how

    return fault


EXPERIMENTS: Mapping[str, Fault] = {
    "nothing fails": _nothing,
    "worker host cut off and back": _cut(lambda site: site.workers[0]),
    "worker host killed": _killed(
        lambda site: site.workers[0], lambda site: site.start_worker(site.workers[0])
    ),
    "worker host slow": _slow(lambda site: site.workers[0]),
    "database host cut off and back": _cut(lambda site: site.database),
    "database host killed": _killed(lambda site: site.database, Site.start_database),
    "database host slow": _slow(lambda site: site.database),
    "queue host cut off and back": _cut(lambda site: site.queue),
    "queue host killed": _killed(lambda site: site.queue, Site.start_queue),
    "API host cut off and back": _cut(lambda site: site.api),
    "API host killed": _killed(lambda site: site.api, Site.start_api),
}
"""The experiments by name, in their order."""


def run(names: Sequence[str], stages: int, folder: Path) -> list[Outcome]:
    """Run experiments, each with new stages on the same hosts; ``stages`` are sent before and after each fault."""
    with Network() as network:
        site = Site(network, folder)
        network.enter(site.cart)
        key = site.start()
        _wait(lambda: _lives(site), "the API")
        return [_experiment(name, site, key, stages) for name in names]


def _experiment(name: str, site: Site, key: str, stages: int) -> Outcome:
    outcome = Outcome(name)
    cart = Cart(site, key, outcome)
    cart.start()
    cart.wait(stages)
    how = EXPERIMENTS[name](site)
    outcome.notes += [how] if how else []
    healed = time.monotonic()
    cart.wait(stages)
    cart.stop()
    _wait(lambda: _unended(site, cart) == 0, "all jobs to end")
    outcome.ended_s = time.monotonic() - healed
    outcome.restarted = not all(alive for host in (site.api, *site.workers) for alive in host.running())
    _count(site, cart, outcome)
    sys.stderr.write(f"{name}: {outcome.sent} stages, ended {outcome.ended_s:.1f} s after\n")
    return outcome


def _count(site: Site, cart: Cart, outcome: Outcome) -> None:
    """Ask the database what was lost, doubled or differs."""
    stored = _ask(
        site,
        """
        SELECT s.name, (SELECT count(*) FROM jobs j WHERE j.subject_id = s.id AND j.state = 'succeeded'),
               (SELECT count(*) FROM measurements m WHERE m.stage_id = s.id),
               (SELECT count(*) FROM features f WHERE f.stage_id = s.id),
               (SELECT count(*) FROM events e WHERE e.subject_id = s.id AND e.action = 'stage:measured'),
               (SELECT count(*) FROM jobs j JOIN events e ON e.subject_id = j.id AND e.action = 'job:started'
                WHERE j.subject_id = s.id),
               (SELECT md5(string_agg(t.triad::text, ',' ORDER BY t.position)) FROM triads t WHERE t.stage_id = s.id)
        FROM stages s WHERE s.surgery_id = %s
        """,
        cart.surgery,
    )
    times = Counter(row[0] for row in stored)
    outcome.sent = len(cart.names)
    whole = {row[0] for row in stored if row[1:5] == (1, 1, 2, 1)}
    outcome.lost = sum(name not in whole for name in cart.names)
    outcome.doubled = sum(count > 1 for count in times.values()) + sum(
        row[2] > 1 or row[4] > 1 for row in stored
    )
    outcome.differing = len({row[6] for row in stored if row[0] in whole}) - 1
    outcome.started_again = sum(row[5] - 1 for row in stored if row[0] in whole)


def _unended(site: Site, cart: Cart) -> int:
    query = """
        SELECT count(*) FROM jobs j JOIN stages s ON j.subject_id = s.id
        WHERE s.surgery_id = %s AND j.state IN ('queued', 'running')
    """
    return int(_ask(site, query, cart.surgery)[0][0])


def _ask(site: Site, query: str, *values: str) -> list[tuple[Any, ...]]:
    with psycopg.connect(site.dsn, connect_timeout=10) as connection:
        return connection.execute(query, values).fetchall()


def _lives(site: Site) -> bool:
    try:
        return httpx.get(f"{site.url}/health/live", timeout=5, trust_env=False).status_code == 200
    except httpx.TransportError:
        return False


def _wait(condition: Callable[[], Any], what: str) -> Any:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise TimeoutError(f"waited too long for {what}")


def _server_programs() -> Path:
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"))
    return found[-1].parent


def _as_postgres() -> list[str]:
    return ["setpriv", "--reuid", "postgres", "--regid", "postgres", "--clear-groups"]


def missing() -> str | None:
    """Return why this cannot run here, None if it can."""
    if not any(Path("/usr/lib/postgresql").glob("*/bin/postgres")):
        return "PostgreSQL is not installed (Debian: apt install postgresql)"
    if shutil.which("redis-server") is None:
        return "Redis is not installed (Debian: apt install redis-server)"
    return reason_against()


def grids_and_bars(outcomes: Sequence[Outcome]) -> tuple[Grid, list[Bar]]:
    """Return the table and the bars of some outcomes."""
    columns = (
        "experiment", "accepted", "503", "no answer", "other answers", "lost", "doubled", "differing",
        "started again", "ended after, s",
    )  # fmt: skip
    rows = [
        (
            o.name, o.sent, o.refused, o.unreachable, o.broken, o.lost, o.doubled, o.differing, o.started_again,
            f"{o.ended_s:.1f}",
        )
        for o in outcomes
    ]  # fmt: skip
    total = {
        key: sum(getattr(o, key) for o in outcomes)
        for key in ("sent", "lost", "doubled", "differing", "broken")
    }
    promised = ("lost", "doubled", "differing")
    checks = [Bar(f"{key}: none", f"{total[key]} of {total['sent']}", total[key] == 0) for key in promised]
    checks.append(Bar("no answer but 2xx, 409 and 503", str(total["broken"]), total["broken"] == 0))
    ended = [o.name for o in outcomes if o.restarted]
    checks.append(Bar("no process ended that was not killed", ", ".join(ended) or "none", not ended))
    return Grid.of("Hosts that fail while a cart sends stages", columns, rows), checks


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="bench.hosts", description=__doc__)
    parser.add_argument(
        "--experiment", action="append", choices=list(EXPERIMENTS), help="only this one; may be repeated"
    )
    parser.add_argument("--stages", type=int, default=10, help="stages before and after each fault")
    parser.add_argument("--check", action="store_true", help="exit status 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    parser.add_argument("--logs", type=Path, help="folder to keep the logs in")
    options = parser.parse_args(arguments)
    reason = missing()
    if reason is not None:
        sys.stdout.write(f"not run: {reason}\n")
        return 0
    with tempfile.TemporaryDirectory(prefix="spinewatch-hosts-") as name:
        folder = Path(name)
        folder.chmod(0o755)
        try:
            outcomes = run(options.experiment or list(EXPERIMENTS), options.stages, folder)
        finally:
            if options.logs is not None:
                options.logs.mkdir(parents=True, exist_ok=True)
                for log in folder.glob("*.log"):
                    shutil.copy(log, options.logs)
    grid, checks = grids_and_bars(outcomes)
    grid.print()
    bars(checks).print()
    for outcome in outcomes:
        for note in outcome.notes[:5]:
            sys.stdout.write(f"{outcome.name}: {note}\n")
    if options.json is not None:
        options.json.write_text(json.dumps([asdict(outcome) for outcome in outcomes], indent=1) + "\n")
    return 0 if all(bar.holds for bar in checks) or not options.check else 1


if __name__ == "__main__":
    sys.exit(main())
