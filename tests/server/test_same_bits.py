"""A run through database, worker and HTTP, killed or not, equals the run in tensors bit for bit."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from server.db import Database, connect
from server.runs import get_run
from server.schema import upgrade
from server.settings import Settings
from server.starting import start
from tests.server import raising

ROOT = Path(__file__).parents[2]
ANSWERS = 60
KILLS = 20


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data=tmp_path, claim_seconds=0.2)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = connect(settings)
    upgrade(database)
    yield database
    database.close()


@contextmanager
def web(settings: Settings) -> Iterator[str]:
    """The real server on a free port: its URL."""
    with subprocess.Popen(
        [sys.executable, "-m", "commands.main", "web", "--port", "0"],
        cwd=ROOT,
        env={**os.environ, "PARENTING_DATA": str(settings.data)},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout
            line = process.stdout.readline()
            yield next(word for word in line.split() if word.startswith("http")).rstrip("/")
        finally:
            process.send_signal(signal.SIGTERM)


@contextmanager
def parent(url: str, run: int, limit: int) -> Iterator[subprocess.Popen[str]]:
    """A parent in a process of its own."""
    command = [sys.executable, "-m", "tests.server.answering", url, str(run), str(limit)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        yield process
        process.kill()


def begin(db: Database) -> int:
    return start(db, raising.ISLAND.new("human")).id


def settle(db: Database, run: int, answers: int) -> None:
    """Wait until so many answers were heard and the agent waits for the next."""
    until = time.monotonic() + 60
    while time.monotonic() < until:
        now = get_run(db, run)
        assert now.status == "active", now.error
        if now.answers == answers and now.waiting is not None:
            return
        time.sleep(0.02)
    pytest.fail("the agent did not come to wait for its parent")


def check(db: Database, run: int) -> None:
    saved = raising.last(db, run)
    ticks = int(saved.state.keys.tick[0])
    assert ticks > ANSWERS
    assert int(saved.tally.choices.sum()) == ANSWERS
    assert int(saved.state.maturity[0]) == 3
    assert raising.same_bits(saved, raising.inline(ticks)) == []


def test_through_the_database_and_http(settings: Settings, db: Database) -> None:
    run = begin(db)
    with web(settings) as url, raising.worker(settings) as worker, parent(url, run, ANSWERS) as script:
        assert script.communicate(timeout=100)[0].split() == [str(ANSWERS)]
        settle(db, run, ANSWERS)
        worker.terminate()
        worker.join(5)
        assert worker.exitcode == 0
    check(db, run)


@pytest.mark.timeout(300)
def test_killed_at_twenty_random_moments(
    settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SIGKILL, twenty times, while it raises the agent; checkpoints are written often, so that kills hit them
    too.
    """
    monkeypatch.setattr("server.life.CHECKPOINT_SECONDS", 0.05)
    moments = random.Random(5)
    run = begin(db)
    with web(settings) as url, parent(url, run, ANSWERS) as script:
        kills = 0
        while kills < KILLS or script.poll() is None:
            with raising.worker(settings) as worker:
                if kills < KILLS:
                    worker.join(moments.uniform(0.25, 0.6))
                    assert worker.exitcode is None
                    kills += 1
                else:
                    assert script.communicate(timeout=100)[0].split() == [str(ANSWERS)]
                    settle(db, run, ANSWERS)
                    worker.terminate()
                    worker.join(5)
    check(db, run)
