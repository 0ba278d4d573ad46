"""Relive a table of answers (format 1): the same settings must ask every question of the table again.

So the record becomes whole: the questions that nobody answered are asked once more on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent import query as queries
from parenting.agent.amendment import Correction, TickEvent
from parenting.agent.config import Config
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.parents.replay import Moment, ReplayMismatchError, ReplayParent
from parenting.server.archive.format1 import Line, Table
from parenting.server.codec import CHOICES, decode, encode, kind_name
from parenting.server.errors import SetupError
from parenting.server.snapshot import initial_snapshot

Progress = Callable[[int, int], None]


class Asked(NamedTuple):
    """A question that the agent asked, as it is stored."""

    tick: int
    kind: str
    maturity: int
    votes: int
    clips: dict[str, Any]
    policy: tuple[int, int]  # its stage, and its gradient steps in that stage


class Record:
    """A table as moments by tick."""

    def __init__(self, table: Table, world: Gridworld, stages: int) -> None:
        self.world, self.stages = world, stages
        self.asked = {line.tick: line for line in table.lines}
        heard = [line for line in table.lines if line.applied_tick is not None]
        self.heard = sorted(heard, key=lambda line: line.applied_tick or 0)
        self.heard_at = {line.applied_tick: line for line in heard}
        self.events = table.events
        self.nothing = queries.empty(1, stages, world.height, world.width)

    def __call__(self, tick: int) -> Moment:
        """The moment of a tick."""
        events = [one.event for one in self.events if one.applied_tick == tick]
        there = self.asked.get(tick)
        asked = self.nothing if there is None else self._query(there)
        line = self.heard_at.get(tick)
        if line is None:
            return Moment(events, queries.silence(self.nothing), asked)
        before = self.before(line)
        if before is None:
            return Moment(events, self._answer(line), asked)
        standing = [self._answer(one) for one in self.standing(tick)]
        correction = Correction(self._answer(line), self._answer(before), standing, line.tick)
        return Moment(events, queries.silence(self.nothing), asked, correction)

    def before(self, line: Line) -> Line | None:
        """Return the last answer to the same question that was heard before this one."""
        earlier = [one for one in self.heard if one.tick == line.tick]
        place = earlier.index(line)
        return earlier[place - 1] if place else None

    def standing(self, tick: int) -> Sequence[Line]:
        """Return the answers that stand after a tick, by the tick at which each was heard."""
        latest = {line.tick: line for line in self.heard if (line.applied_tick or 0) <= tick}
        return sorted(latest.values(), key=lambda line: line.applied_tick or 0)

    def _answer(self, line: Line) -> Answer:
        return Answer(query=self._query(line), choice=torch.tensor([int(CHOICES[line.choice])]))

    def _query(self, line: Line) -> Query:
        clips = {"left": line.left, "right": line.right}
        try:
            return decode(self.world, self.stages, line.kind, line.maturity, clips, line.votes)
        except (LookupError, TypeError, ValueError, RuntimeError):
            raise SetupError(
                f"The clips of answer {line.number} do not fit the run's level or stages. "
                "Give the settings that the run had: --level, --preset, --set."
            ) from None


class Remembering(ReplayParent):
    """A parent who says what the table says, and keeps what is asked."""

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        self.record, self.asked = record, list[Asked]()
        self.withdrawn = dict[
            int, int
        ]()  # the tick before which the agent stopped waiting, by the question's
        self.policy = (1, 0)

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        """The events and the correction of this tick; some end the wait for guidance."""
        found = super().events(state)
        corrected = self._moment.correction is not None and bool(self._moment.answer.choice[0])
        if corrected or any(getattr(one, "kind", "") == "end_episode" for one in found):
            for one in self.asked:
                if one.kind == "guidance" and one.tick not in self.record.asked:
                    self.withdrawn.setdefault(one.tick, self.tick)
        return found

    def take(self, state: AgentState) -> Answer:
        """The answer that was heard in this tick."""
        self.policy = int(state.maturity[0]), int(state.learner.steps[0])
        return super().take(state)

    def post(self, query: Query) -> None:
        """Keep what is asked, and hold it against the table.

        Raises:
            ReplayMismatchError: the table has another question, or another policy asked it.
        """
        line, kind = self.record.asked.get(self.tick), kind_name(query)
        if line is not None:
            super().post(query)
            there = (line.policy.stage, line.policy.gradient_steps)
            if None not in there and there != self.policy:
                raise ReplayMismatchError(self.tick, self._moment.asked, query)
        if kind is not None:
            clips, stage = encode(self.record.world, query), int(query.maturity[0])
            self.asked.append(Asked(self.tick, kind, stage, int(query.votes[0]), clips, self.policy))


class Relived(NamedTuple):
    """The questions of a run, answered or not, and when guidance was withdrawn, by the question's tick."""

    asked: Sequence[Asked]
    withdrawn: dict[int, int]


def relive_table(
    table: Table,
    world: Gridworld,
    config: Config,
    seed: int,
    weights: Tensor | None,
    progress: Progress = lambda done, total: None,
) -> Relived:
    """Relive a run from its first tick to the last one that its table knows of.

    Raises:
        SetupError: with these settings the agent asks something else than the table has.
    """
    lived = initial_snapshot(world, config, seed, weights)
    parent = Remembering(Record(table, world, config.max_clip_length))
    state, settings = lived.state, lived.config
    try:
        for tick in range(1, table.last + 1):
            state, _, _, settings, _ = parenting.tick(world, settings, state, parent)
            progress(tick, table.last)
    except ReplayMismatchError as error:
        raise SetupError(_parted(error)) from None
    return Relived(parent.asked, parent.withdrawn)


def _parted(error: ReplayMismatchError) -> str:
    asked, recorded = kind_name(error.asked), kind_name(error.recorded)
    here = "asks nothing" if asked is None else f"asks a question of {asked}"
    other = "another one" if recorded == asked else f"one of {recorded}"
    return (
        f"With these settings the agent {here} at tick {error.tick}, and the table has {other} there. "
        "Give the seed, the preset and the changes (--seed, --preset, --set) that the run had, and its log "
        "(--events) if an operator changed something. Another processor or version of torch may ask "
        "otherwise, too. Nothing was imported."
    )
