"""The store is locked, full, read-only or away for a while, and all goes on by itself afterwards.

Parents answer all the time. Every run goes on, what was told is stored (A1), nothing is counted or asked
twice (A2, C3), each agent's state is what its record gives (C1, C2), no process ends, no reply is a 500 (D2,
D4), and each process writes a line a second into its log at most.
"""

from __future__ import annotations

import random
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

import httpx2
import pytest

from parenting.server.db import Database, connect
from parenting.server.migrate import upgrade
from parenting.server.new_run import start
from parenting.server.settings import Settings
from tests.faults import parent
from tests.faults.figures import Figures
from tests.faults.house import House
from tests.faults.rebuilt import rebuild
from tests.faults.troubles import (
    Restarting,
    files_bounded,
    filled,
    folder_with_quota,
    immutable,
    lock_of_another,
    small_disk,
)
from tests.lengths import TORTURE, length
from tests.server.raising import ISLAND

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 3000))]
WEBS, WORKERS = length((1, 1), (2, 3))
LOCKED_SECONDS = 20.0
FULL_SECONDS = length(7.0, 120.0)
HELD, HELD_SECONDS = length(0, 15), 2.0
RESTARTS, ENDED = length(1, 15), length(2, 60)
STOPS = 30
STOPPED_EVERY = (5.0, 40.0)
PROCESSES = ("web", "worker 1")
AWAY_SECONDS = length(5.0, 60.0)
FIRST_LINES = 4
"""Lines that a process may write besides: one for each kind of refusal, and one that the store is back."""


@pytest.fixture(autouse=True)
def calm_parents(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parents that send again ten times a second: faster ones would only take the processor."""
    monkeypatch.setattr(parent, "PAUSE", 0.1)


@contextmanager
def inhabited(
    settings: Settings, db: Database, rng: random.Random, webs: int = WEBS, workers: int = WORKERS
) -> Iterator[House]:
    """A house with two runs at work; at the end all of them have gone on, and the promises hold."""
    runs = [start(db, ISLAND.new("human")).id for _ in range(2)]
    with House(settings, workers=workers, webs=webs) as house:
        house.keep()
        house.move_in(runs, 2, rng)
        house.until_told(3)
        yield house
        for one in house.parents:
            one.told = 0
        house.until_told(4)
        until_all_go_on(house, runs)
        house.move_out()
        assert house.audit() == []
        for run in runs:
            assert rebuild(house.store, run) == []


def until_all_go_on(house: House, runs: list[int]) -> None:
    """Wait until each of the runs has heard an answer since."""
    end = time.monotonic() + 120
    while any(not any(one.told for one in house.parents if one.run_id == run) for run in runs):
        assert time.monotonic() < end, house.state()
        time.sleep(0.05)


def endure(house: House, trouble: AbstractContextManager[None], seconds: float) -> None:
    """Let a trouble last: every process lives through it, and its log stays short."""
    before, since = {name: lines(house, name) for name in house.commands}, time.monotonic()
    pids = {name: one.process.pid for name, one in house.commands.items()}
    with trouble:
        time.sleep(seconds)
        assert httpx2.get(f"{house.url}/healthz", timeout=5, trust_env=False).status_code == 200
    house.until_told(1)
    lasted = time.monotonic() - since
    for name, one in house.commands.items():
        said = one.said()
        assert (one.alive, one.process.pid) == (True, pids[name]), f"{name} ended: {said}"
        assert "Traceback" not in said
        assert lines(house, name) - before[name] <= lasted + FIRST_LINES, said


def lines(house: House, name: str) -> int:
    return house.commands[name].said().count("\n")


@contextmanager
def elsewhere(folder: Path, tmp_path: Path) -> Iterator[tuple[Settings, Database]]:
    """A database in a folder of its own; the files of the harness are not in it."""
    settings = Settings(data=tmp_path, database_url=f"sqlite:///{folder / 'parenting.db'}")
    db = connect(settings)
    upgrade(db)
    yield settings, db
    db.close()


@pytest.mark.slow_on("postgresql")
def test_a_lock_of_another_program_is_waited_for(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures
) -> None:
    """SQLite's write lock, or a lock of PostgreSQL's tables, for four times as long as anybody waits."""
    with inhabited(settings, db, rng) as house:
        where = settings.data / "parenting.db" if store == "sqlite" else str(settings.database_url)
        endure(house, lock_of_another(where), LOCKED_SECONDS)
        figures.count("troubles of the store", f"a lock for {LOCKED_SECONDS:g} s")


def reader_is_served(house: House) -> bool:
    return httpx2.get(f"{house.url}/api/v1/runs", timeout=10, trust_env=False).status_code == 200


@pytest.mark.only("sqlite", "PostgreSQL's disk is its server's own; its word for a full one is injected")
def test_a_full_disk_is_waited_for(
    store: str, tmp_path: Path, rng: random.Random, figures: Figures, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is freed is taken at once, the ballast too; readers are served all the time."""
    monkeypatch.setenv("PARENTING_BALLAST", "true")
    with (
        small_disk() as disk,
        elsewhere(disk, tmp_path) as (settings, db),
        inhabited(settings, db, rng) as house,
    ):
        endure(house, still_read(house, filled(disk)), FULL_SECONDS)
        figures.count("troubles of the store", f"a full disk for {FULL_SECONDS:g} s")


@pytest.mark.slow
@pytest.mark.only("sqlite", "PostgreSQL's files are its server's own")
def test_a_limit_on_the_size_of_files_is_waited_for(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures
) -> None:
    """`ulimit -f` of web and worker: a write fails with EFBIG in the middle of the log."""
    with inhabited(settings, db, rng) as house:
        pids = [one.process.pid for one in house.commands.values()]
        endure(house, still_read(house, files_bounded(pids)), AWAY_SECONDS)
        figures.count("troubles of the store", f"a limit on files for {AWAY_SECONDS:g} s")


@pytest.mark.slow
@pytest.mark.only("sqlite", "PostgreSQL's files are its server's own")
def test_a_folder_that_is_read_only_is_waited_for(
    store: str, tmp_path: Path, rng: random.Random, figures: Figures
) -> None:
    """Immutable for root, too (`chattr +i`): every write of an open file fails with EPERM."""
    folder = tmp_path / "database"
    folder.mkdir()
    with elsewhere(folder, tmp_path) as (settings, db), inhabited(settings, db, rng) as house:
        endure(house, still_read(house, immutable(folder)), AWAY_SECONDS)
        figures.count("troubles of the store", f"a read-only folder for {AWAY_SECONDS:g} s")


@contextmanager
def still_read(house: House, trouble: AbstractContextManager[None]) -> Iterator[None]:
    """A trouble of writers alone."""
    with trouble:
        yield
        assert reader_is_served(house)


@pytest.mark.only("sqlite", "PostgreSQL's files are its server's own")
def test_a_quota_that_is_used_up_costs_no_answer(
    store: str, tmp_path: Path, rng: random.Random, figures: Figures
) -> None:
    """A real one, of btrfs. SIGBUS may end web and worker, which share the log's index in memory.

    They are started again once there is room, as `parenting up` does.
    """
    with (
        folder_with_quota() as folder,
        elsewhere(folder, tmp_path) as (settings, db),
        inhabited(settings, db, rng) as house,
    ):
        house.endings.add(-signal.SIGBUS)
        with filled(folder):
            time.sleep(AWAY_SECONDS)
        for name, one in house.commands.items():
            ended = "goes on" if one.alive else "ended and started again"
            assert "Traceback" not in one.said()
            assert not one.alive or "refuse" in one.said(), f"{name} met no quota"
            figures.count("troubles of the store", f"a quota used up for {AWAY_SECONDS:g} s: {name} {ended}")


@contextmanager
def restarting(tmp_path: Path) -> Iterator[tuple[Restarting, Settings, Database]]:
    """A PostgreSQL of its own, with a database."""
    cluster = Restarting()
    cluster.create("restarted")
    settings = Settings(data=tmp_path, database_url=cluster.url("restarted"))
    db = connect(settings)
    upgrade(db)
    yield cluster, settings, db
    db.close()
    cluster.stop()


@pytest.mark.only("postgresql", "SQLite has no server")
def test_postgresql_may_be_restarted_and_its_processes_killed(
    store: str, tmp_path: Path, rng: random.Random, figures: Figures
) -> None:
    """In order, by a crash that loses what was committed without waiting, and one connection at a time."""
    with (
        restarting(tmp_path) as (cluster, settings, db),
        inhabited(settings, db, rng) as house,
    ):
        for name, trouble, seconds in rng.sample(troubles := server_troubles(cluster, rng), len(troubles)):
            house.until_told(rng.randint(1, 3))
            endure(house, trouble(), rng.uniform(0, seconds))
            figures.count("troubles of PostgreSQL", name)


@pytest.mark.skipif(
    not TORTURE,
    reason="`make torture`: ten minutes at least; a restart and a crash are among the troubles above",
)
@pytest.mark.only("postgresql", "SQLite has no server")
def test_postgresql_stops_again_and_again_under_load(
    store: str, tmp_path: Path, rng: random.Random, figures: Figures
) -> None:
    """Every 5 to 40 s for up to 2 s, with two web processes and three workers (DBOS tests itself so)."""
    with (
        restarting(tmp_path) as (cluster, settings, db),
        inhabited(settings, db, rng, webs=2, workers=3) as house,
    ):
        for _ in range(STOPS):
            time.sleep(rng.uniform(*STOPPED_EVERY))
            name = rng.choice(("fast", "immediate", "held"))
            with cluster.held() if name == "held" else cluster.stopped(name):
                time.sleep(rng.uniform(0, HELD_SECONDS))
            house.until_told(1)
            figures.count("stops of PostgreSQL under load", name)


def server_troubles(
    cluster: Restarting, rng: random.Random
) -> list[tuple[str, Callable[[], AbstractContextManager[None]], float]]:
    """Each with its name and the seconds that it lasts at most, as often as a test of this length has it."""
    restarts = [(f"restart, {mode}", partial(cluster.stopped, mode), 2.0) for mode in ("fast", "immediate")]
    held = [("all processes stopped (SIGSTOP)", cluster.held, HELD_SECONDS)]
    killed = [(f"kill -9 behind {name}", partial(cluster.crashed, name, rng), 0.0) for name in PROCESSES]
    ended = [
        (f"a connection of {name} ended", partial(cluster.without, name, rng), 0.0) for name in PROCESSES
    ]
    return [*restarts * RESTARTS, *held * HELD, *killed * RESTARTS, *ended * ENDED]
