"""Web and workers as processes that are killed and started again while parents and an operator work."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import httpx2
from sqlalchemy import make_url

from parenting.server.settings import Settings
from tests.faults.auditor import Store, audit
from tests.faults.ledger import Ledger, read
from tests.faults.parent import SKIPS, Parent
from tests.faults.points import Point, arm, marked
from tests.server.processes import Command
from tests.server.serving import free_port

PATCHES = {
    "parenting.server.checkpoint_pace.CHECKPOINT_SECONDS": 0.05,
    "parenting.server.checkpoint_pace.QUIET_SECONDS": 0.05,
    "parenting.server.checkpoint_pace.CHECKPOINT_SHARE": 1.0,
    "parenting.server.checkpoint_pace.LARGE_SECONDS": 1e9,
    "parenting.server.checkpoint_pace.CHECKPOINT_SPEED": 1e12,
    "parenting.server.session.METRIC_SECONDS": 0.05,
    "parenting.server.checkpoint_parts.PART_BYTES": 400_000,
}
"""Checkpoints and metrics are written often, so that kills hit them too; each checkpoint has a few parts.

They take up to half of a run's time. With the share that the product allows them, a slow machine writes one
every 20 s, and a process that is to die at its third one lives for a minute.
"""
LEASE_SECONDS = 2.0
CLAIM_SECONDS = 2.0
"""Of three workers: with a shorter one they take runs from one another all the time where all is slow."""
PATIENCE = 180.0
LOOK_SECONDS = 5.0
"""After waiting in vain for so long, a test looks at whether a run has failed."""

UNSAVED = """
SELECT id FROM run WHERE NOT EXISTS (
  SELECT 1 FROM checkpoint JOIN answer ON answer.run_id = checkpoint.run_id
  WHERE checkpoint.run_id = run.id AND answer.applied_tick <= checkpoint.tick)
"""


def in_time(end: float, said: Callable[[], str]) -> None:
    """Give up waiting once a moment is over. It asserts nothing: a test that waits in vain caught nothing.

    Raises:
        TimeoutError: it is over.
    """
    if time.monotonic() > end:
        raise TimeoutError(said())


def web_at(url: str) -> tuple[str, ...]:
    """The command line of a web process."""
    return ("web", "--port", url.rpartition(":")[2])


class House:
    """The processes of one data folder. `orders` are their command lines, by name.

    The first web process is *web* at `url`; those at `others` are *web 2* and so on.
    """

    def __init__(
        self, settings: Settings, points: Sequence[Point] = (), workers: int = 1, webs: int = 1
    ) -> None:
        self.settings, self.points = settings, points
        self.url = f"http://127.0.0.1:{free_port()}"
        self.others = [f"http://127.0.0.1:{free_port()}" for _ in range(1, webs)]
        self.orders: dict[str, tuple[str, ...]] = {"web": web_at(self.url)}
        self.orders |= {f"web {number}": web_at(url) for number, url in enumerate(self.others, 2)}
        self.orders |= {f"worker {number}": ("worker",) for number in range(1, workers + 1)}
        self.patches: Mapping[str, Any] = PATCHES
        self.prepare: Callable[[], object] | None = None
        self.endings: set[int | None] = {None, -signal.SIGKILL}
        self.commands: dict[str, Command] = {}
        self.ledger = Ledger(settings.data / "ledger")
        self.parents: list[Parent] = []
        self.operator: Operator | None = None

    @property
    def store(self) -> Store:
        """The database, for the auditor."""
        url = self.settings.url
        return Store(Path(make_url(url).database or "") if url.startswith("sqlite") else url)

    def begin(self, name: str, point: Point | None = None, later: bool = False) -> Command:
        """Start a process, which kills itself at the point, if there is one; `later`: from `release` on."""
        gate = self._gate(name) if later else None
        if gate is not None:
            gate.unlink(missing_ok=True)
        environment = {"PARENTING_LEASE_SECONDS": str(LEASE_SECONDS)}
        if "worker 3" in self.orders:
            environment["PARENTING_CLAIM_SECONDS"] = str(CLAIM_SECONDS)
        if self.settings.database_url is not None:
            url = make_url(self.settings.database_url)
            if url.get_backend_name() == "postgresql":  # its server tells connections apart by this
                url = url.update_query_dict({"application_name": name})
            environment["PARENTING_DATABASE_URL"] = url.render_as_string(hide_password=False)
        self.commands[name] = Command(
            *self.orders[name],
            data=self.settings.data,
            patches=self.patches,
            prepare=self.prepare or partial(arm, str(self.mark(name)), point, self.points, gate),
            environment=environment,
        )
        return self.commands[name]

    def release(self, name: str) -> None:
        """Let a process that was started with a point for `later` kill itself there."""
        self._gate(name).touch()

    def _gate(self, name: str) -> Path:
        return self.mark(name).with_suffix(".gate")

    def mark(self, name: str) -> Path:
        """The file that says where a process was."""
        return self.settings.data / f"{name.replace(' ', '-')}.mark"

    def keep(self, but: str = "") -> None:
        """Start again whatever does not run, but for a process that is about to kill itself."""
        for name in self.orders:
            if name == but:
                continue
            one = self.commands.get(name)
            if one is None or not one.alive:
                code = None if one is None else one.process.exitcode
                assert code in self.endings, f"{name} ended with {code}: {one and one.said()}"
                self.begin(name)

    def kill(self, name: str) -> str:
        """SIGKILL; the place where the process was."""
        self.commands[name].kill()
        return marked(self.mark(name))

    def signal(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a process."""
        os.kill(self.commands[name].process.pid, number)

    def move_in(
        self, runs: Sequence[int | str], parents: int, rng: random.Random, skips: float = SKIPS
    ) -> None:
        """Let so many parents a run begin to answer, by all web processes, and an operator to interfere.

        `skips` is the share of questions that they skip.
        """
        urls = [self.url, *self.others]
        for run in runs:
            for number in range(parents):
                url, name = urls[number % len(urls)], f"{number}.of.{run}"
                self.parents.append(Parent(url, run, name, self.ledger, rng.random(), skips))
        self.operator = Operator(self.url, runs, rng.random())
        for thread in (*self.parents, self.operator):
            thread.start()

    @property
    def told(self) -> int:
        """Answers that parents were told of."""
        return sum(parent.told for parent in self.parents)

    def until_told(self, more: int) -> None:
        """Wait until so many more answers were told: work goes on after whatever happened."""
        wanted, end = self.told + more, time.monotonic() + PATIENCE
        look = time.monotonic() + LOOK_SECONDS
        while self.told < wanted:
            in_time(end, lambda: f"nothing was told: {self.state()}")
            if time.monotonic() > look:
                look += LOOK_SECONDS
                failed = self.store.rows("SELECT id, reason FROM run WHERE status = 'failed'")
                assert failed == [], self.state()
            self.keep()
            time.sleep(0.01)

    def until_saved(self) -> None:
        """Wait until each run has a checkpoint with an answer in it: after early deaths it may have none."""
        end = time.monotonic() + PATIENCE
        while bare := self.store.rows(UNSAVED):
            message = f"without an answer in a checkpoint: {bare}"
            in_time(end, lambda: f"{message}; {self.state()}")  # noqa: B023  # called at once
            self.keep()
            time.sleep(0.05)

    def until_killed(self, name: str, what: str) -> None:
        """Wait until a process has killed itself."""
        one, end = self.commands[name], time.monotonic() + PATIENCE
        while one.alive:
            in_time(end, lambda: f"never hit: {what}")
            time.sleep(0.002)
        assert one.process.exitcode == -signal.SIGKILL, f"{what}: {one.process.exitcode}: {one.said()}"

    def until_stopped(self, name: str) -> None:
        """Wait until a process has stopped itself (SIGSTOP)."""
        status, end = Path(f"/proc/{self.commands[name].process.pid}/stat"), time.monotonic() + PATIENCE
        while status.read_text().rpartition(")")[2].split()[0] != "T":
            in_time(end, lambda: f"{name} did not stop: {self.commands[name].said()}")
            time.sleep(0.01)

    def move_out(self) -> None:
        """Let the parents leave, and stop the processes in order, once each run has a checkpoint."""
        self.until_saved()
        for person in self._people():
            person.leaving.set()
        for person in self._people():
            person.join(PATIENCE)
        self.keep()
        for name in sorted(self.commands, reverse=True):  # workers before the web
            code = self.commands[name].stop()
            assert code in (0, -signal.SIGTERM), f"{name} ended with {code}: {self.commands[name].said()}"

    def break_off(self) -> None:
        """SIGKILL for all at once, and the people leave."""
        for person in self._people():
            person.leaving.set()
        for one in self.commands.values():
            one.kill()
        for person in self._people():
            person.join(PATIENCE)

    def state(self) -> str:
        """Runs, open questions and what the processes said, for the message of a test that fails."""
        runs = self.store.rows("SELECT id, status, reason, waiting, tick, answers, worker FROM run")
        queries = self.store.rows("SELECT run_id, status, count(*) AS n FROM query GROUP BY run_id, status")
        said = {name: one.said()[-1000:] for name, one in self.commands.items()}
        return f"{runs} {queries} {said} people: {[one.is_alive() for one in self._people()]}"

    def _people(self) -> Sequence[Parent | Operator]:
        return [*self.parents, *([self.operator] if self.operator else [])]

    def audit(self) -> list[str]:
        """Every breach of a promise: what parents complained of, and what the auditor finds."""
        complaints = [one for parent in self.parents for one in parent.complaints]
        return complaints + audit(self.store, read(self.ledger.file))

    def __enter__(self) -> House:
        return self

    def __exit__(self, *_: object) -> None:
        for person in self._people():
            person.leaving.set()
        for one in self.commands.values():
            if one.alive:
                one.kill()
        self.ledger.close()


class Operator(threading.Thread):
    """Pauses and resumes, changes a probability, ends an episode, again and again."""

    def __init__(self, url: str, runs: Sequence[int | str], seed: float) -> None:
        super().__init__(daemon=True)
        self.http = httpx2.Client(base_url=f"{url}/api/v1/", timeout=10, trust_env=False)
        self.runs, self.rng, self.leaving = runs, random.Random(seed), threading.Event()

    def run(self) -> None:
        """Interfere until told to leave; at last every run goes on."""
        while not self.leaving.wait(self.rng.uniform(0, 0.4)):
            self._interfere(self.rng.choice(self.runs))
        for run in self.runs:
            self._post(f"runs/{run}/resume")
        self.http.close()

    def _interfere(self, run: int | str) -> None:
        verb = self.rng.choice(("pause", "change", "end-episode"))
        if verb == "change":
            value = round(self.rng.uniform(0.5, 0.9), 3)
            self._post(f"runs/{run}/change", {"name": "p_rec", "value": value})
            return
        self._post(f"runs/{run}/{verb}")
        if verb == "pause":
            self._post(f"runs/{run}/resume")

    def _post(self, path: str, body: dict[str, Any] | None = None) -> None:
        """Post it once; what is lost with a killed server is lost."""
        try:
            self.http.post(path, json=body)
        except httpx2.TransportError:
            return
