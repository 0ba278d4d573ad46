"""Keep the moves of a life as its ticks pass (`server.moves`). Nothing of the agent is changed."""

from __future__ import annotations

from collections.abc import Sequence

from parenting.agent.amendment import TickEvent
from parenting.agent.events import EndEpisode
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.server.counters import Counters
from parenting.server.db import Database
from parenting.server.moves import BEGIN, GOAL, OVER, PAUSE, UNSAFE, MovesWriter
from parenting.server.runs import Claim
from parenting.server.snapshot import Snapshot


class Lived:
    """The moves of one agent in a worker."""

    def __init__(self, world: Gridworld, db: Database, mine: Claim, saved: Snapshot) -> None:
        """Begin after the last tick of `saved`."""
        tick = int(saved.state.keys.tick[0])
        self._world, self._writer = world, MovesWriter(db, mine, tick)
        self._ended = tick == 0 or self._over(saved.state.world)  # the next tick begins an episode
        self._deaths = int(saved.tally.deaths[0])

    def see(self, state: AgentState, tally: Counters, events: Sequence[TickEvent]) -> None:
        """Look at the tick that has just passed, and at the events that applied before it."""
        report, deaths = state.info, int(tally.deaths[0])
        begins = self._ended or any(isinstance(event, EndEpisode) for event in events)
        move = int(report.action[0]) if bool(report.moved[0]) else PAUSE
        move |= BEGIN * begins | UNSAFE * (deaths != self._deaths)
        if bool(state.world.terminated[0]):
            move |= OVER | GOAL * self._on_goal(state.world)
        self._writer.note(move)
        self._deaths, self._ended = deaths, self._over(state.world)

    def forget(self, state: AgentState) -> None:
        """Make the last tick unknown: another machine's record put the agent where it is now."""
        self._writer.forget()
        self._ended = self._over(state.world)

    def write(self) -> None:
        """Store the moves up to now.

        Raises:
            LostClaimError: another worker trains this run now.
        """
        self._writer.write()

    def _over(self, world: WorldState) -> bool:
        return bool((world.terminated | self._world.truncated(world))[0])

    def _on_goal(self, here: WorldState) -> bool:
        return bool(self._world.lookup("G")[self._world.tile(here.board, here.agent)][0])
