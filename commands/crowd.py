"""A crowd of scripted parents: many people, each with a connection and a name, answer many runs at once."""

from __future__ import annotations

import asyncio
import random
import secrets
import signal
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from ssl import SSLContext
from typing import TYPE_CHECKING, Any, Literal

from parenting.commands.client import Client, RefusedError, UnavailableError
from parenting.commands.crowd_figures import Figures
from parenting.commands.crowd_person import WAIT, Person, trust
from parenting.commands.errors import UsageError

if TYPE_CHECKING:
    from parenting.commands.judge import Judge

Thinking = Literal["exponential", "fixed"]
PAUSE = 0.2
"""Seconds before a request that was not served is sent again."""
SHOW_SECONDS = 2.0
"""Seconds between two live lines."""
MOST_RUNS = 100_000
"""Runs that `--runs` can name."""
DIGITS = 4000
"""Digits of a number at most: Python reads few more."""


@dataclass(frozen=True)
class Plan:
    """The people of a crowd, how long they think, and when they leave."""

    people: int
    think: float = 1.0
    thinking: Thinking = "exponential"
    limit: int | None = None  # answers, in all
    seconds: float | None = None
    timeout: float = 60.0  # without any answer of anybody
    end_episodes: bool = False


@dataclass
class Home:
    """A run that people of the crowd answer."""

    public_id: str
    judge: Judge
    before: int = 0  # answers that it has had, which may have tired its parent
    people: int = 0
    over: bool = False


@dataclass
class Crowd:
    """A crowd, and what it has met."""

    client: Client
    plan: Plan
    homes: Sequence[Home]
    figures: Figures = field(default_factory=Figures)
    began: float = 0.0
    why: str = ""
    _tls: SSLContext | None = None
    _done: asyncio.Event = field(default_factory=asyncio.Event)
    _answered_at: float = 0.0
    _here: Counter[str] = field(default_factory=Counter)

    async def work(self, show: Callable[[int], None]) -> None:
        """Answer until a limit, the end of all runs, a long silence, or Ctrl-C; `why` says which.

        Raises:
            UsageError: the server refuses a request for good.
        """
        self.began = self._answered_at = time.monotonic()
        self._tls = trust(self.client)
        loop = asyncio.get_running_loop()
        with suppress(ValueError, RuntimeError):  # in another thread than the main one there is no Ctrl-C
            loop.add_signal_handler(signal.SIGINT, self.end, "Stopped.")
        tasks = [asyncio.create_task(self._live(at)) for at in range(self.plan.people)]
        watch, ended = asyncio.create_task(self._watch(show)), asyncio.create_task(self._ended())
        try:
            for life in asyncio.as_completed([*tasks, ended]):
                await life  # an error of one ends the work of all
                if self._done.is_set():
                    break
        finally:
            for task in (*tasks, watch, ended):
                task.cancel()
            found = await asyncio.gather(*tasks, return_exceptions=True)
            with suppress(ValueError, RuntimeError):
                loop.remove_signal_handler(signal.SIGINT)
        for error in found:
            if isinstance(error, Exception):
                raise error

    async def _ended(self) -> None:
        await self._done.wait()

    def end(self, why: str) -> None:
        """Send everybody home."""
        self.why = self.why or why
        self._done.set()

    @property
    def here(self) -> int:
        """People who have not left."""
        return self._here.total()

    async def _watch(self, show: Callable[[int], None]) -> None:
        plan = self.plan
        while not self._done.is_set():
            now = time.monotonic()
            shown = SHOW_SECONDS if plan.seconds is None else self.began + plan.seconds - now
            await asyncio.sleep(max(0.0, min(SHOW_SECONDS, shown)))
            show(self.here)
            now = time.monotonic()
            if plan.seconds is not None and now - self.began >= plan.seconds:
                self.end(f"The {plan.seconds:g} s are over.")
            if now - self._answered_at >= plan.timeout:
                self.end(f"Nobody could answer anything for {plan.timeout:g} s.")

    async def _live(self, at: int) -> None:
        """Live one person's life: lease, think, answer, and go to another run where one's own is over."""
        name = f"crowd-{secrets.token_urlsafe(8)}"
        draws = random.Random(at)
        home: Home | None = self.homes[at % len(self.homes)]
        async with Person(self.client, name, self._tls) as person:
            while home is not None:
                home.people += 1
                self._here[home.public_id] += 1
                try:
                    await self._stay(person, home, draws)
                finally:
                    home.people -= 1
                    self._here[home.public_id] -= 1
                living = [one for one in self.homes if not one.over]
                home = min(living, key=lambda one: one.people, default=None)
        if not self.here:
            self.end("All runs are over or rest.")

    async def _stay(self, person: Person, home: Home, draws: random.Random) -> None:
        since: float | None = None
        while not home.over:
            try:
                question = await person.post(f"runs/{home.public_id}/queries/lease", person.said(wait=WAIT))
                if question is None:
                    await self._look(person, home)
                    continue
                if since is not None:
                    self.figures.waits[question["kind"]].append(time.monotonic() - since)
                choice = home.judge.choice(question, home.before + self.figures.answers[home.public_id])
                await asyncio.sleep(self._thought(draws))
                since = await self._answer(person, home, question, choice)
            except UnavailableError as error:
                self.figures.errors[str(error)] += 1
                await asyncio.sleep(PAUSE)

    def _thought(self, draws: random.Random) -> float:
        think = self.plan.think
        return draws.expovariate(1 / think) if think and self.plan.thinking == "exponential" else think

    async def _answer(
        self, person: Person, home: Home, question: dict[str, Any], choice: str
    ) -> float | None:
        """Send an answer until it is stored; return when it was, None if nobody needs it any more."""
        verb, said = ("skip", {}) if choice == "skip" else ("answer", {"choice": choice})
        said |= {"parent": "scripted", "database": question["database"], "run": question["run_public_id"]}
        said["question"] = question["public_id"]
        while True:
            began = time.monotonic()
            try:
                await person.post(f"queries/{said['question']}/{verb}", person.said(**said))
            except UnavailableError as error:
                self.figures.errors[str(error)] += 1
                await asyncio.sleep(PAUSE)
                continue
            except RefusedError as error:
                if error.status != 409:
                    raise
                self.figures.unneeded += 1
                return None
            now = self._answered_at = time.monotonic()
            self.figures.requests.append(now - began)
            if choice == "skip":
                self.figures.skipped += 1
            else:
                self.figures.answers[home.public_id] += 1
            if self.plan.limit is not None and self.figures.answered >= self.plan.limit:
                self.end(f"These are the {self.plan.limit} that were wanted.")
            return now

    async def _look(self, person: Person, home: Home) -> None:
        """See why a run asks nothing; a stuck one may have its episode ended."""
        run = await person.get(f"runs/{home.public_id}")
        home.over = run["worker"] == "done" or run["resting"]
        if not home.over and run["waiting"] == "stuck" and self.plan.end_episodes:
            await person.post(f"runs/{home.public_id}/end-episode")
            self.figures.episodes += 1


def chosen_runs(text: str) -> list[int]:
    """Return the runs that `--runs` names, such as 1,3,7-12.

    Raises:
        UsageError: it cannot be read, or names more than `MOST_RUNS`.
    """
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        if not _is_number(first) or (last and not _is_number(last)) or int(last or first) < int(first):
            raise UsageError(f"--runs: {text!r} cannot be read at {part!r}. Write it as 1,3,7-12.")
        begin, end = int(first), int(last or first)
        if len(found) + end - begin >= MOST_RUNS:
            raise UsageError(f"--runs: {part!r} names too many runs. Name at most {MOST_RUNS} in all.")
        found += range(begin, end + 1)
    return list(dict.fromkeys(found))


def _is_number(text: str) -> bool:
    """Return whether a text is a whole number that Python reads."""
    return text.isdecimal() and len(text) <= DIGITS
