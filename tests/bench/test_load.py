"""The benchmark of load on a small service, and its counting on constructed values."""

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from bench import load, load_carts, load_latency, load_soak, load_summary, load_throughput
from bench.load_carts import ManyCarts
from bench.load_kills import Kills
from bench.load_latency import Latency
from bench.load_pairs import make_pairs
from bench.load_processes import Role
from bench.load_record import Ledger, count
from bench.load_service import LoadService
from bench.load_soak import Soak
from bench.load_summary import Summaries
from bench.load_throughput import Throughput
from bench.tables import Bar
from spinewatch.imaging.decoding import decode_image
from tests.backends import new_database, new_queue, run_sql

WHOLE = Ledger(expected=6, lost=0, doubled=0)


def missed(checks: tuple[Bar, ...]) -> list[str]:
    return [bar.promise for bar in checks if not bar.holds]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoadService]:
    folder = tmp_path_factory.mktemp("load")
    with (
        new_database(folder, tables=False, name="spinewatch") as database,
        new_queue(folder, database) as queue,
        LoadService(folder, database_url=database, queue_url=queue) as service,
    ):
        yield service


def test_pairs_follow_from_the_seed_and_differ() -> None:
    pairs = make_pairs(5, seed=3)
    assert pairs == make_pairs(5, seed=3)
    assert len({pair.left for pair in pairs} | {pair.right for pair in pairs}) == 10
    assert decode_image(pairs[0].left).shape == (416, 568)


@pytest.mark.timeout(600)
def test_processes_have_their_roles(service: LoadService) -> None:
    roles = Counter(process.role for process in service.processes())
    assert (roles[Role.SUPERVISOR], roles[Role.API], roles[Role.WORKER]) == (1, 1, 2)
    assert all(process.rss_bytes > 0 for process in service.processes())


@pytest.mark.timeout(600)
def test_one_cart_is_timed_beside_the_library(service: LoadService) -> None:
    found = load_latency.measure(service, pairs=2)
    assert len(found.service) == len(found.library) == 2
    assert min(found.service) > 0
    assert found.long_poll


@pytest.mark.timeout(600)
def test_rates_and_processor_time_are_measured(service: LoadService) -> None:
    found = load_throughput.measure(service, pairs=8, rounds=1)
    assert min(*found.bare, *found.backlog, *found.sending) > 0
    assert found.api_ms > 0
    assert found.workers_ms > 0


@pytest.mark.timeout(600)
def test_stages_of_many_carts_are_counted_and_a_loss_is_seen(service: LoadService) -> None:
    found = load_carts.measure(service, carts=3, pairs=2)
    assert found.ledger == WHOLE
    assert found.states == {"succeeded": 6}
    assert missed(found.bars) == []
    ((surgery,),) = run_sql(
        service.database_url, "SELECT id FROM surgeries ORDER BY created_at DESC, id DESC LIMIT 1"
    )
    assert count(service, {surgery: 3}) == Ledger(expected=3, lost=1, doubled=0)
    assert count(service, {surgery: 1}) == Ledger(expected=1, lost=0, doubled=1)


@pytest.mark.timeout(600)
def test_a_record_is_filled_and_its_summaries_are_timed(service: LoadService) -> None:
    found = load_summary.measure(service, count=3, requests=5)
    assert len(found.http) == len(found.in_process) == 5
    assert found.size_bytes > 10_000
    assert found.stage_bytes[0] > 0
    with service.client() as client:
        newest = client.get("/v1/surgeries?limit=1").json()["items"][0]
        summary = client.get(f"/v1/surgeries/{newest['id']}/summary").json()
    assert len(summary["stages"]) == load_summary.STAGES
    assert all(stage["spine"] and stage["triads"] for stage in summary["stages"])


@pytest.mark.timeout(600)
def test_memory_is_read_while_carts_send(service: LoadService) -> None:
    found = load_soak.measure(service, hours=2 / 3600)
    assert found.stages > 0
    assert set(found.growth) == set(Role)


def test_counts_of_several_records_are_added() -> None:
    assert Ledger.total([WHOLE, Ledger(4, 1, 2)]) == Ledger(10, 1, 2)


def test_bars_hold_at_the_promise_and_not_beyond() -> None:
    assert missed(Latency([110.0] * 2, [40.0] * 2, long_poll=True).bars) == []
    assert len(missed(Latency([111.0] * 2, [40.0] * 2, long_poll=True).bars)) == 1
    assert missed(Throughput([10.0], [8.5], [5.0], 25.0, 60.0).bars) == []
    assert len(missed(Throughput([10.0], [8.4], [5.0], 26.0, 60.0).bars)) == 2
    carts = ManyCarts(3, 2, Counter({202: 6}), Counter({"succeeded": 6}), WHOLE)
    assert missed(carts.bars) == []
    bad = ManyCarts(3, 2, Counter({503: 1}), Counter({"failed": 6}), Ledger(6, 1, 0))
    assert len(missed(bad.bars)) == 2
    assert missed(Summaries(1, 1, [9.9], [1.0], 1, (1.0, 1.0)).bars) == []
    assert len(missed(Summaries(1, 1, [10.1], [1.0], 1, (1.0, 1.0)).bars)) == 1
    kills = (3, Counter({"api": 1}), WHOLE, Counter[str](), 0, [14.9], Counter[int]())
    assert missed(Kills(*kills).bars) == []
    assert len(missed(Kills(3, Counter(), WHOLE, Counter({"x": 1}), 0, [15.1], Counter()).bars)) == 2
    times = [float(k) for k in range(100)]
    flat = Soak(99.0, 1, times, {Role.API: [10_000_000] * 100})
    growing = Soak(99.0, 1, times, {Role.API: [10_000_000 + 50_000 * k for k in range(100)]})
    assert missed(flat.bars) == []
    assert len(missed(growing.bars)) == 1


@pytest.mark.timeout(600)
def test_the_command_prints_bars_and_checks_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(load_latency, "PAIRS", 2)
    out = tmp_path / "bars.json"
    status = load.main(["--part", "latency", "--check", "--json", str(out), "--folder", str(tmp_path)])
    bars = json.loads(out.read_text())
    assert [set(bar) for bar in bars] == [{"bar", "reached", "holds"}]
    assert status == int(not bars[0]["holds"])
    assert "upload to result" in capsys.readouterr().out
