"""Milestones of a life: what an agent did for the first time, told to its parent once.

They are read off the ticks as they pass, and stand in the run's row with their ticks. Nothing in the agent
reads them.
"""

from __future__ import annotations

from collections.abc import Mapping

from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.server.counters import Counters

CALM_TICKS = 100
GOAL, CALM = "goal", "calm"
"""The names of the milestones; `server.reads.growth` has their sentences."""


class Milestones:
    """The milestones that one agent has reached, by name, each with its tick."""

    def __init__(
        self, world: Gridworld, reached: Mapping[str, int] | None, tick: int, tally: Counters
    ) -> None:
        """Begin after a tick. A calm time is counted from there: what was before is not known here."""
        self.world, self.reached, self.new = world, dict(reached or {}), False
        self._unsafe_at, self._deaths, self._episodes = tick, int(tally.deaths[0]), int(tally.episodes[0])

    def see(self, state: AgentState, tally: Counters) -> None:
        """Look at the tick that has just passed."""
        tick, deaths, episodes = int(state.keys.tick[0]), int(tally.deaths[0]), int(tally.episodes[0])
        if deaths != self._deaths:
            self._unsafe_at = tick
        if episodes != self._episodes and GOAL not in self.reached and self._on_goal(state):
            self._reach(GOAL, tick)
        if CALM not in self.reached and tick - self._unsafe_at >= CALM_TICKS:
            self._reach(CALM, tick)
        self._deaths, self._episodes = deaths, episodes

    def _on_goal(self, state: AgentState) -> bool:
        here = state.world
        on_goal = self.world.lookup("G")[self.world.tile(here.board, here.agent)]
        return bool((here.terminated & on_goal)[0])

    def _reach(self, name: str, tick: int) -> None:
        self.reached[name], self.new = tick, True
