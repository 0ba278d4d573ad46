"""Actions are drawn from pi: frequencies over thousands of draws, against the softmax.

They lie within three standard deviations. The seeds are fixed, so a frequency that holds once holds always.
"""

from __future__ import annotations

from itertools import combinations

import pytest
import torch
from torch import Tensor

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.pairing import EXPLORE
from parenting.agent.policy import draw
from parenting.agent.query import Answer, Choice, QueryKind, silence
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import Stream, gumbel, keys

WORLD = registry.make("unsafe-exploration", time_limit=25)
NETWORK = network_of(WORLD)
TRIALS, TICKS = 64, 160


def born(**settings: float) -> AgentState:
    """Agents who share one policy that has clear preferences: Glorot's weights, enlarged."""
    weights = 1.7 * NETWORK.init_params(keys(8, 1), torch.float32)[0]
    return parenting.init(WORLD, config(**settings), keys(2, TRIALS), weights)


def config(**settings: float) -> Config:
    quiet: dict[str, object] = {"p_guid": 0, "p_rec": 0, "p_pref": 0, "p_train": 0}
    return Config.model_validate({**quiet, "pretrain": True, "time_limit": 25, **settings})


def softmax(state: AgentState) -> Tensor:
    """pi(a|s) [N, 4] of each trial where it is."""
    return parenting.observe(WORLD, NETWORK, state).logits.double().softmax(1)


def hold_within_three_sigma(happened: Tensor, chance: Tensor) -> None:
    """Counts of outcomes [draws, K], true or false, against the sum of their chances [draws, K]."""
    spread = (chance * (1 - chance)).sum(0).sqrt()
    deviation = (happened.double() - chance).sum(0) / spread
    assert float(deviation.abs().max()) < 3, deviation.tolist()


@pytest.mark.parametrize(
    "logits", [(0, 0, 0, 0), (2, 1, 0, -1), (3, 0, 0, 3), (-5, -1, -1, -1), (0, 0.5, 4, 0)]
)
def test_drawn_actions_follow_softmax(logits: tuple[float, ...]) -> None:
    z = torch.tensor(logits, dtype=torch.float64).expand(40_000, 4)
    drawn = draw(z, gumbel(keys(6, len(z)).uniform(Stream.ACT, 4)))
    hold_within_three_sigma(drawn[:, None] == torch.arange(4), z.softmax(1))


def test_a_saturated_policy_never_draws_anything_else() -> None:
    z = torch.tensor([0.0, 90.0, 0.0, 0.0]).expand(40_000, 4)
    assert draw(z, gumbel(keys(6, len(z)).uniform(Stream.ACT, 4))).tolist() == [1] * len(z)


def test_the_agents_moves_follow_softmax_of_its_own_logits() -> None:
    """By rank, the most probable action first: a wrong draw favours or neglects it everywhere."""
    state, happened, chances = born(), [], []
    query = parenting.no_query(WORLD, config(), state)
    for _ in range(TICKS):
        state, query = parenting.step(WORLD, config(), state, silence(query))
        chance, action = softmax(state.replace(world=state.info.before)).sort(1, descending=True)
        assert state.info.moved.all()
        happened.append(action == state.info.action[:, None])
        chances.append(chance)
    best = float(torch.cat(chances)[:, 0].mean())
    assert 0.4 < best < 0.9, f"{best}: the preferences are not clear, or leave nothing to chance"
    hold_within_three_sigma(torch.cat(happened), torch.cat(chances))


def test_the_two_candidates_are_drawn_from_softmax_without_replacement() -> None:
    """Unordered pairs by rank: P(a, b) = pi_a pi_b (1 / (1 - pi_a) + 1 / (1 - pi_b)); fair sides."""
    settings = {"p_guid": 1.0}
    state, happened, chances, sides = born(**settings), [], [], []
    query = parenting.no_query(WORLD, config(**settings), state)
    pairs = list(combinations(range(4), 2))
    for _ in range(TICKS):
        choice = torch.where(query.kind == QueryKind.NONE, int(Choice.NONE), int(Choice.EITHER))
        state, query = parenting.step(WORLD, config(**settings), state, Answer(query=query, choice=choice))
        assert (query.kind == QueryKind.GUIDANCE).all() or (query.kind == QueryKind.NONE).all()
        if bool((query.kind == QueryKind.NONE).any()):
            continue
        pi, action = softmax(state).sort(1, descending=True)
        rank = (query.action[:, :, 0, None] == action[:, None]).int().argmax(2)
        happened.append(
            torch.stack([(rank.sort(1).values == torch.tensor(pair)).all(1) for pair in pairs], 1)
        )
        both = [pi[:, a] * pi[:, b] * (1 / (1 - pi[:, a]) + 1 / (1 - pi[:, b])) for a, b in pairs]
        chances.append(torch.stack(both, 1))
        sides.append(rank[:, :1] < rank[:, 1:])
    assert len(happened) > TICKS // 3
    hold_within_three_sigma(torch.cat(happened), torch.cat(chances))
    hold_within_three_sigma(
        torch.cat(sides), torch.full((len(torch.cat(sides)), 1), 0.5, dtype=torch.float64)
    )


def test_exploratory_clips_begin_by_softmax_without_its_argmax() -> None:
    """Eq. (4); and the exploitative ones by the argmax (Eq. 3)."""
    settings = {"p_rec": 1.0}
    state, happened, chances = born(**settings), [], []
    query = parenting.no_query(WORLD, config(**settings), state)
    for _ in range(TICKS):
        exploring = state.recorder.next_kind == EXPLORE
        state, query = parenting.step(WORLD, config(**settings), state, silence(query))
        pi, action = softmax(state.replace(world=state.info.before)).sort(1, descending=True)
        drawn = action == state.info.action[:, None]
        assert drawn[~exploring, 0].all()
        assert not drawn[exploring, 0].any()
        happened.append(drawn[exploring, 1:])
        chances.append((pi[:, 1:] / pi[:, 1:].sum(1, keepdim=True))[exploring])
    assert len(torch.cat(happened)) > TRIALS * TICKS // 3
    hold_within_three_sigma(torch.cat(happened), torch.cat(chances))
