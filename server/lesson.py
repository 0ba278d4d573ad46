"""The lesson of an answer: the policy's probabilities in the asked cell, before it was heard and now.

Both are read off the policy; nothing of the agent is changed, and no random number is drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from jaxtyping import Float, UInt8
from torch import Tensor

from parenting.agent.amendment import Amend, TickEvent
from parenting.agent.init import network_of
from parenting.agent.parent import Parent
from parenting.agent.query import Answer, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld, local_state


@dataclass(frozen=True)
class Asked:
    """The state in which the agent asked, and its policy there before it heard the answer."""

    tick: int  # in which the answer was heard
    kind: str
    cell: tuple[int, int]
    observation: UInt8[Tensor, "1 H W"]
    local_state: UInt8[Tensor, "1 4"]
    before: list[float]


class Lesson:
    """The effect of the last answer so far."""

    def __init__(self, world: Gridworld) -> None:
        """Nothing was heard yet."""
        self.network = network_of(world)
        self.asked: Asked | None = None
        self.corrected: Asked | None = None  # the last answer that was heard as a correction, by X alone
        self._told: tuple[int, int] | None = None  # the answer's tick, and the gradient steps then

    def hear(self, state: AgentState, answer: Answer) -> None:
        """Take note of an answer, before the agent hears it. A skip has no lesson."""
        if bool(answer.judges[0]):
            self.asked = self._asked(state, answer)

    def correct(self, state: AgentState, answer: Answer) -> None:
        """Take note of a correction, before X is rebuilt with it. The parent is told nothing of it."""
        self.corrected = self._asked(state, answer)

    def _asked(self, state: AgentState, answer: Answer) -> Asked:
        seen, agent = answer.query.observation[:, 0, 0], answer.query.agent[:, 0, 0]
        near, (row, column) = local_state(seen, agent), agent[0].tolist()
        return Asked(
            int(state.keys.tick[0]) + 1,
            QueryKind(int(answer.query.kind[0])).name.lower(),
            (row, column),
            seen.clone(),
            near,
            self._chances(state.learner.params, seen, near),
        )

    def news(self, state: AgentState) -> dict[str, Any] | None:
        """Return what the answer has changed, if the policy has learnt since this was told last."""
        asked, steps = self.asked, int(state.learner.steps[0])
        if asked is None or self._told == (asked.tick, steps):
            return None
        self._told = asked.tick, steps
        after = self._chances(state.learner.params, asked.observation, asked.local_state)
        return {
            "tick": asked.tick,
            "kind": asked.kind,
            "cell": list(asked.cell),
            "before": asked.before,
            "after": after,
        }

    def _chances(
        self, parameters: Float[Tensor, "1 P"], seen: UInt8[Tensor, "1 H W"], near: UInt8[Tensor, "1 4"]
    ) -> list[float]:
        chances = self.network.logits(parameters, seen, near)[0].double().softmax(-1)
        return [round(chance, 6) for chance in chances.tolist()]


class Overheard:
    """A parent whose answers somebody else hears as well, just before the agent does."""

    def __init__(self, parent: Parent, lesson: Lesson) -> None:
        """Let a lesson hear answers and corrections, with the state before the tick."""
        self.parent, self.lesson = parent, lesson

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        """The parent's events; corrections are overheard."""
        events = self.parent.events(state)
        for event in events:
            if isinstance(event, Amend):
                self.lesson.correct(state, event.answer)
        return events

    def take(self, state: AgentState) -> Answer:
        """The parent's answer, which is overheard."""
        answer = self.parent.take(state)
        self.lesson.hear(state, answer)
        return answer

    def post(self, query: Query) -> None:
        """Hand the query to the parent."""
        self.parent.post(query)
