"""Parents for `train` and `tick`: one's own, the scripted one, and one that repeats what was said."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import torch

from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.query import Answer, Choice, QueryKind
from parenting.agent.state import AgentState
from parenting.library.question import Query, Question, choice_of, question
from parenting.library.set_aside import Open, SetAside
from parenting.library.worlds import World


class EndedError(Exception):
    """Training ends before its time: a callback or a parent says so. The agents are kept as they are."""


class Parent(ABC):
    """Your own parent: subclass it and write `answer`.

    An answer is heard in the tick after the question. From `begin` on, `self.world`, `self.config` and
    `self.trials` say whose parent this is, and `self.in_training` which trials may still ask.

    Example:
        >>> import parenting as pt
        >>> class StayDry(pt.Parent):
        ...     def answer(self, question):
        ...         wet = [clip.tiles[-1] == "W" for clip in (question.left, question.right)]
        ...         return {(0, 0): "either", (0, 1): "left", (1, 0): "right", (1, 1): "neither"}[*wet]
        >>> result = pt.train("unsafe-exploration", parent=StayDry(), until="queries:20", progress=False)
        >>> len(result.answers)
        20
    """

    world: World
    config: Config
    trials: int

    @abstractmethod
    def answer(self, question: Question) -> Choice | str | None:
        """Answer one question of one trial.

        Args:
            question: Two clips, as plain Python and as tensors.

        Returns:
            "left", "right", "either" (both are as good), "neither" (both are unacceptable: an agent that
            asked for guidance asks about other moves) or "skip" (it cannot be told), or a `Choice`; None to
            be asked again next tick. After a skip an agent that asked for guidance asks about another pair of
            moves, and about the skipped ones again once none is left. A preference is asked
            once more, later, and then dropped.
        """

    def begin(self, world: World, config: Config, trials: int) -> None:
        """Prepare for new agents at tick 0. `train` calls it, and `tick` does in an agent's first tick."""
        self.world, self.config, self.trials = world, config, trials
        self.in_training: Sequence[int] = range(trials)
        self._open: list[Open] = []
        self._aside = SetAside()

    def events(self, state: AgentState) -> Sequence[Event]:
        """Return the operator's events that apply before this tick: none, unless a subclass has some."""
        return ()

    def take(self, state: AgentState) -> Answer:
        """Return at most one answer a trial: that to its oldest question which has one."""
        left, last, heard = list[Open](), list[Open](), dict[int, tuple[Query, Choice]]()
        for one in self._open:
            if one.trial not in self.in_training:
                continue
            said = None if one.trial in heard else self.answer(question(one.query, 0, one.trial))
            choice = Choice.NONE if said is None else choice_of(said, type(self).__name__)
            if choice == Choice.NONE:
                left.append(one)
            elif choice == Choice.SKIP and not one.guides and not one.skipped:
                last.append(one._replace(skipped=True))  # put back once
            else:
                heard[one.trial] = one.query, choice
                if one.guides:
                    self._aside.heard(one, choice)
        self._open = [one for one in left if not self._aside.closed(one)] + last
        return compose_answer(self, heard)

    def post(self, query: queries.Query) -> None:
        """Keep what is asked in this tick until it is answered."""
        known = Query.of(query, self.world)
        asking = (query.kind != QueryKind.NONE).nonzero().flatten().tolist()
        self._open += [Open(trial, known.row(trial)) for trial in asking]
        self._open += self._aside.asked_again(query)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"


def compose_answer(parent: Parent, heard: Mapping[int, tuple[Query, Choice]]) -> Answer:
    """Return the answers of a tick: those that were heard, by trial, and silence elsewhere."""
    blank = nothing(parent.world, parent.config, 1), Choice.NONE
    each = [heard.get(trial, blank) for trial in range(parent.trials)]
    choices = torch.tensor([int(choice) for _, choice in each])
    return Answer(query=Query.joined([query for query, _ in each]), choice=choices)


def nothing(world: World, config: Config, trials: int) -> Query:
    """Return an empty query."""
    return Query.of(
        queries.empty(trials, config.max_clip_length, world.height, world.width, world.device), world
    )
