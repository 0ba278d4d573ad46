"""Guidance that is asked again until an answer is confirmed, for one trial in plain Python (ours).

docs/paper.md, "Parents who err", says why. It shares with the agent the random keys, the config and the
worlds, and nothing else.
"""

from collections.abc import Callable, Iterable
from math import exp

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from reference.clips import Clip, Query
from reference.frugal import Frugal
from reference.parenting import GUIDANCE, Reference

MOST = 5
Pair = tuple[int, int]  # two actions, the lower first
Verdict = int | str  # the better action of a pair, or *either*, or *neither*


class Confirming(Reference):
    """One trial whose guidance moves it only once the verdict is likely enough, or after five votes."""

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        seed: int,
        trial: int,
        choose: Callable[[Clip, Clip, str], str],
    ) -> None:
        self.votes: dict[Pair, list[Verdict]] = {}  # in this pause
        self.left: dict[Pair, int] = {}  # the action that stood left when the pair was last shown
        self.repeats = self.dissents = 0
        super().__init__(world, config, seed, trial, choose)

    def resolve(self, choice: str, actions: tuple[int, int]) -> int | None:
        """Count a vote; decide as any answer does once its verdict is confirmed."""
        pair: Pair = (min(actions), max(actions))
        votes = self.votes.setdefault(pair, [])
        votes.append({"left": actions[0], "right": actions[1]}.get(choice, choice))
        self.left[pair] = actions[0]
        verdict, posterior = self.leading(pair, votes)
        if posterior < self.config.confirm and len(votes) < MOST:
            return None
        self.repeats += len(votes) - 1
        self.dissents += sum(vote != verdict for vote in votes[1:])
        if verdict != "neither":
            self.votes = {}
        if isinstance(verdict, int):
            verdict = "left" if verdict == actions[0] else "right"
        return super().resolve(verdict, actions)

    def leading(self, pair: Pair, votes: Iterable[Verdict]) -> tuple[Verdict, float]:
        """Return the verdict of the greatest posterior, and that; of equals *neither* leads."""
        lower, higher = pair
        z = self.logits(self.pi)
        opinion = 1 / (1 + exp(-max(-2.0, min(2.0, z[lower] - z[higher]))))  # at most 2 in log odds
        weight: dict[Verdict, float]
        weight = {"neither": 0.25, lower: opinion / 2, higher: (1 - opinion) / 2, "either": 0.25}
        e = self.error_rate()
        for vote in votes:
            for verdict in weight:
                weight[verdict] *= 1 - e if vote == verdict else e / 3
        best = max(weight, key=lambda verdict: weight[verdict])
        return best, weight[best] / sum(weight.values())

    def error_rate(self) -> float:
        """The parent's error rate: how many repeats were overruled, after one in ten that were not."""
        return min(0.5, (1 + self.dissents) / (10 + self.repeats))

    def ask(self) -> None:
        """Ask about a pair that is not decided once more, or as ever."""
        if not self.ask_again():
            super().ask()

    def ask_again(self) -> bool:
        """Ask about a pair that is not decided, its sides swapped; return False if there is none."""
        open_pairs = [pair for pair in sorted(self.votes) if not (self.refused or set()) & set(pair)]
        if self.refused is None or not open_pairs:
            return False
        lower, higher = open_pairs[0]
        left, right = (higher, lower) if self.left[open_pairs[0]] == lower else (lower, higher)
        self.post(Query(GUIDANCE, self.forecast(left), self.forecast(right), 1))
        return True


class FrugalConfirming(Frugal, Confirming):
    """One trial that remembers every vote, and asks again before it is moved by any."""

    def error_rate(self) -> float:
        """The parent's error rate, as repeats tell it."""
        return Confirming.error_rate(self)

    def ask_or_reuse(self) -> int | None:
        """Ask about a pair that is not decided once more; else ask or reuse. No vote outlives its pause."""
        if self.ask_again():
            return None
        approved = super().ask_or_reuse()
        if self.refused is None:
            self.votes = {}
        return approved
