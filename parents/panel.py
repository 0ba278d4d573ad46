"""A panel: several parents answer every question, and the agent hears their consensus (ours).

The paper has one parent. Members are parents of a batch like any other; what they have said so far decides
how far each of them is trusted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.events import Event
from parenting.agent.init import network_of
from parenting.agent.parent import BatchParent
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld, local_state
from parenting.parents.consensus import Beliefs, Consensus

ANSWERS = (Choice.LEFT, Choice.RIGHT, Choice.EITHER, Choice.NEITHER)
"""The answers that count as votes; *skip* does not."""
APART = 2**40
"""Added to a trial's seed for each member after the first, so that no two members err together."""
SUREST = 2.0
"""The policy's opinion of a question is at most this, in nats: it has learnt from the same parents."""

Opinion = Callable[[AgentState, Query], Float64[Tensor, "N C"]]
"""The agent's own view of the question: a factor of the probability of each answer."""


class Panel:
    """Members who answer every question, and the consensus of all their votes so far, each trial's apart."""

    def __init__(
        self,
        members: Sequence[BatchParent],
        consensus: Consensus,
        query: Query,
        opinion: Opinion | None = None,
    ) -> None:
        """Begin with `query`, the empty query of the run.

        Raises:
            ValueError: there is no member.
        """
        if not members:
            raise ValueError("A panel needs at least one parent.")
        self.members, self.consensus, self.opinion, self.query = members, consensus, opinion, query
        trials = len(query.kind)
        self.votes = torch.zeros(trials, 0, len(members), dtype=torch.int64, device=query.kind.device)
        self.opinions = torch.zeros(trials, 0, len(ANSWERS), dtype=torch.float64, device=query.kind.device)
        self.count = torch.zeros_like(query.kind)

    def take(self, state: AgentState) -> Answer:
        """The consensus on what was asked a tick ago; *skip* where every member skips."""
        said = [member.take(_apart(state, number)).choice for number, member in enumerate(self.members)]
        told = torch.stack(said, 1)
        voted = ((told != Choice.NONE) & (told != Choice.SKIP)).any(1)
        asked = self.query.kind != QueryKind.NONE
        choice = torch.where(asked & (told == Choice.SKIP).any(1), int(Choice.SKIP), int(Choice.NONE))
        if bool(voted.any()):
            self._remember(state, told, voted)
            choice = choice.index_put((voted.nonzero().squeeze(1),), self._agreed(voted))
        return Answer(query=self.query, choice=choice)

    def _remember(self, state: AgentState, told: Int64[Tensor, "N K"], voted: Bool[Tensor, "N"]) -> None:
        """Write the votes of this tick into each trial's next free place."""
        if int(self.count.max()) == self.votes.shape[1]:
            room = max(8, self.votes.shape[1])
            self.votes = torch.cat((self.votes, self.votes.new_zeros(len(told), room, told.shape[1])), 1)
            more = self.opinions.new_ones(len(told), room, len(ANSWERS))
            self.opinions = torch.cat((self.opinions, more), 1)
        trial = voted.nonzero().squeeze(1)
        place = self.count[trial]
        self.votes[trial, place] = told[trial]
        if self.opinion is not None:
            self.opinions[trial, place] = self.opinion(state, self.query)[trial]
        self.count = self.count + voted

    def _agreed(self, voted: Bool[Tensor, "N"]) -> Int64[Tensor, "n"]:
        """The likeliest answer to the last question of those who were asked; ties go to the first."""
        beliefs, last = self._right(voted), self.count[voted] - 1
        likeliest = beliefs[torch.arange(len(last)), last].argmax(1)
        return torch.tensor(ANSWERS, device=last.device)[likeliest]

    def _right(self, which: Bool[Tensor, "N"]) -> Beliefs:
        most = int(self.count[which].max())
        told, opinions = self.votes[which, :most], self.opinions[which, :most]
        votes = (told[..., None] == torch.tensor(ANSWERS, device=told.device)).double()
        return self.consensus(votes, None if self.opinion is None else opinions).right

    def post(self, query: Query) -> None:
        """Ask every member."""
        self.query = query
        for member in self.members:
            member.post(query)

    def events(self, state: AgentState) -> Sequence[Event]:
        """A panel has no operator."""
        return ()

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        self.query, self.count = self.query.pick(index), self.count[index]
        self.votes, self.opinions = self.votes[index], self.opinions[index]
        for member in self.members:
            member.pick(index)


def policy_opinion(world: Gridworld) -> Opinion:
    """The opinion of pi_T: the odds of the two first actions, at most e^SUREST to one.

    It says nothing of *either* and *neither*.
    """
    network = network_of(world)

    def opinion(state: AgentState, query: Query) -> Float64[Tensor, "N C"]:
        first = query.observation[:, 0, 0]
        where = local_state(first, query.agent[:, 0, 0])
        logits = network.logits(state.learner.params, first, where).double().gather(1, query.action[:, :, 0])
        left = (logits[:, 0] - logits[:, 1]).clamp(-SUREST, SUREST).sigmoid()
        other = torch.full_like(left, 0.5)
        return torch.stack((left, 1 - left, other, other), 1)

    return opinion


def _apart(state: AgentState, member: int) -> AgentState:
    """The agents as a member sees them: with keys of its own."""
    return state.replace(keys=state.keys.replace(seed=state.keys.seed + member * APART))
