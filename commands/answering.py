"""A script that answers a run over HTTP: it leases, answers or skips, waits, and knows when to end."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from parenting._plural import counted
from parenting.commands.client import Client, RefusedError, UnavailableError

if TYPE_CHECKING:
    from parenting.commands.judge import Judge

SHORTEST, LONGEST = 0.01, 0.5
"""Seconds between two requests while nothing is asked. Each pause is half of the time waited so far, so that
few requests lose little time. A stream of events would cost the server more."""
LOOK_SECONDS = 0.25
"""Seconds between two requests for the run while it asks one question after another."""
STUCK_SECONDS = 1.0
"""A run counts as stuck after this long; before that, somebody may just have ended the episode."""

EXITS = {
    "limit": 0,
    "goal": 0,
    "over": 0,
    "optimal": 0,
    "failed": 1,
    "stuck": 1,
    "silent": 1,
    "ctrl-c": 130,
}
"""Each reason to end, with its exit code."""


@dataclass(frozen=True)
class Order:
    """An order: the run whose questions to answer, the name to answer under, and when to end."""

    run: int | str  # its number, or its public id, which no other server's run has
    client_id: str = "scripted"
    limit: int | None = None
    until_optimal: bool = True
    timeout: float = 60.0
    end_episodes: bool = False
    before: int = 0  # answers that it has given before, which may have tired it


@dataclass(frozen=True)
class Ending:
    """The reason why answering ended, one of `EXITS`, and the sentence that says so."""

    kind: str
    sentence: str


@dataclass
class Told:
    """The server's replies, counted: answers that it stored, and questions that needed none any more."""

    choices: Counter[str] = field(default_factory=Counter)
    unneeded: int = 0  # withdrawn or answered by somebody else meanwhile
    episodes: int = 0  # ended
    skipped: int = 0

    @property
    def answered(self) -> int:
        """Answers that are stored."""
        return self.choices.total()


class Answering:
    """One script that answers one run."""

    def __init__(
        self,
        client: Client,
        order: Order,
        judge: Judge,
        stored: Callable[[dict[str, Any]], object],
    ) -> None:
        """Prepare to answer; `stored` is called with the server's receipt of each answer."""
        self.client, self.order, self.judge, self.stored = client, order, judge, stored
        self.told = Told()
        self._asked_at = self._looked_at = time.monotonic()
        self._why = ""  # nothing was asked lately
        self._stuck_since: tuple[int, float] | None = None
        self._ended_at = -1  # the tick at which an episode was ended

    def work(self) -> Ending:
        """Answer until there is a reason to end.

        Raises:
            UsageError: the server refuses a request for good.
        """
        ending = self._look()
        while ending is None:
            ending = self._ending(asked=self.answer_one())
        return ending

    def answer_one(self) -> bool:
        """Answer the most urgent question, if there is one."""
        question = self._lease()
        if question is not None:
            self._answer(question)
        return question is not None

    def _lease(self) -> dict[str, Any] | None:
        try:
            question: dict[str, Any] | None = self.client.post(
                f"runs/{self.order.run}/queries/lease", client_id=self.order.client_id
            )
        except UnavailableError as error:
            self._why = str(error)
            return None
        return question

    def _answer(self, question: dict[str, Any]) -> None:
        """Send an answer until it is stored; the same again changes nothing.

        It names what it is meant for, since another server may come to this address meanwhile.

        Raises:
            RefusedError: another database is served there now; nothing was stored.
        """
        choice = self.judge.choice(question, self.order.before + self.told.answered + self.told.skipped)
        verb, said = ("skip", {}) if choice == "skip" else ("answer", {"choice": choice})
        body = {**said, "client_id": self.order.client_id, "parent": "scripted"}
        body |= {"database": question["database"], "run": question["run_public_id"]}
        body["question"] = question["public_id"]
        self._asked_at = time.monotonic()
        while time.monotonic() - self._asked_at < self.order.timeout:
            try:
                receipt = self.client.post(f"queries/{question['public_id']}/{verb}", **body)
            except UnavailableError as error:
                self._why = str(error)
                time.sleep(SHORTEST)
                continue
            except RefusedError as error:
                if error.status != 409:
                    raise
                self.told.unneeded += 1
            else:
                self._count(choice, receipt)
            self._asked_at = time.monotonic()
            return

    def _count(self, choice: str, receipt: dict[str, Any]) -> None:
        if choice == "skip":
            self.told.skipped += 1
            return
        self.told.choices[choice] += 1
        self.stored(receipt)

    def _ending(self, asked: bool) -> Ending | None:
        """Return why to end now, or None; without a question, wait a little."""
        if self.order.limit is not None and self.told.answered >= self.order.limit:
            return Ending("limit", f"These are the {self.order.limit} that were wanted.")
        now = time.monotonic()
        waited = now - self._asked_at
        ending = None
        if now - self._looked_at >= (LOOK_SECONDS if asked else LOOK_SECONDS / 4):
            self._looked_at = now
            ending = self._look()
        if ending is None and waited >= self.order.timeout:
            ending = Ending("silent", f"{self._why} Nothing was asked for {self.order.timeout:g} s.")
        if ending is None and not asked:
            time.sleep(min(max(SHORTEST, waited / 2), LONGEST))
        return ending

    def _look(self) -> Ending | None:
        """Request the run, and return why there is nothing more to answer, or None."""
        try:
            run = self.client.get(f"runs/{self.order.run}")
        except UnavailableError as error:
            self._why = str(error)
            return None
        self._why = _why(run)
        if run["status"] == "failed":
            return Ending("failed", f"The run failed: {run['reason']}")
        if run["worker"] == "done":
            return Ending("over", f"The run is {run['status']}.")
        if run["resting"]:
            return Ending("goal", f"The run rests at its goal of {counted(run['goal'], 'answer')}.")
        if run["optimal"] and self.order.until_optimal:
            return Ending("optimal", "Its argmax policy is optimal.")
        return self._stuck(run) if run["waiting"] == "stuck" else None

    def _stuck(self, run: dict[str, Any]) -> Ending | None:
        """End the episode once, or say that somebody has to: no action was acceptable."""
        tick, now = run["tick"], time.monotonic()
        if self.order.end_episodes:
            if tick != self._ended_at:
                self._end_episode(tick)
            return None
        if self._stuck_since is None or self._stuck_since[0] != tick:
            self._stuck_since = (tick, now)
        if now - self._stuck_since[1] < STUCK_SECONDS:
            return None
        return Ending(
            "stuck",
            f"No action was acceptable at tick {tick}, so the agent stands still. End the episode on the "
            "run's page, or let this command do so: --end-episodes.",
        )

    def _end_episode(self, tick: int) -> None:
        try:
            self.client.post(f"runs/{self.order.run}/end-episode")
        except UnavailableError as error:
            self._why = str(error)  # the next look shows whether it is still stuck
            return
        self._ended_at = tick
        self.told.episodes += 1
        self._asked_at = time.monotonic()


def _why(run: dict[str, Any]) -> str:
    """Say why nothing is asked."""
    name, tick = f"run {run['id']}", run["tick"]
    sentences = {
        "paused": f"R{name[1:]} is paused: resume it on its page.",
        "no_worker": f"No worker raises {name}. Start one: `parenting worker`.",
        "question": f"Somebody else holds the questions of {name}.",
    }
    return sentences.get(run["state"], f"The agent of {name} explores, at tick {tick}.")
