"""The scripted parent (Sec. 3.1.3) as a public object: it takes world and discount from the run."""

from __future__ import annotations

from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.query import Answer, Choice
from parenting.agent.state import AgentState
from parenting.library.parent import Parent, nothing
from parenting.library.question import Question
from parenting.library.worlds import World
from parenting.parents import scripted
from parenting.parents.scripted import ScriptedRule


class ScriptedParent(Parent):
    """The substitute for a human parent (Sec. 3.1.3).

    It prefers the clip with the greater advantage (Eq. 7, with the config's `gamma`), answers *either* on a
    tie, and *neither* where both moves of a guidance query are unsafe. `train(parent="scripted")` is the
    same.

    Example:
        >>> import parenting as pt
        >>> by_name = pt.train("unsafe-exploration", seed=3, progress=False)
        >>> by_object = pt.train("unsafe-exploration", seed=3, parent=pt.ScriptedParent(), progress=False)
        >>> by_name.answers == by_object.answers
        True
    """

    def begin(self, world: World, config: Config, trials: int) -> None:
        """Work out the exact values of the world.

        Raises:
            ValueError: The world has too many states to list.
        """
        super().begin(world, config, trials)
        self._rule = ScriptedRule(world, config.gamma, inside=config.garden_parent)
        self._scripted = scripted.ScriptedParent(self._rule, nothing(world, config, trials))

    def answer(self, question: Question) -> Choice:
        """Answer one question of this parent's world."""
        return Choice(int(self._rule.answer(question.query)[0]))

    def take(self, state: AgentState) -> Answer:
        return self._scripted.take(state)

    def post(self, query: queries.Query) -> None:
        self._scripted.post(query)
