"""Stages that are lived until they have converged, as Sec. 4.1 supposes.

The agent lives its own life here, tick by tick: it records clips by its frozen policies (Eq. 5, 6), asks
about pairs, and trains on Eq. (2). Only where its clips begin is given to it: in every state, again and again
(exploring starts). A stage goes on until, in every state, X compares the policy's argmax with every other
action, and the policy agrees with all of X. Nothing of that knows V_T.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent import learning, parenting
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.mdp import Model
from parenting.parents.scripted import ScriptedParent, ScriptedRule
from parenting.parents.value_iteration import ValueTable

AGREED = 0.1
"""Minimal difference between the logits of a decided pair."""
CONVERGING = 40
"""Gradient steps of Eq. (2) after every visit to all states, besides one in each tick."""
ROUNDS = 40
"""Visits to every state in a stage; a life that has not settled by then is given up."""
TIE = 1e-6
STAGES = 3

CONFIG = Config(
    p_guid=0,
    p_rec=1,
    p_pref=1,
    learning_rate=0.003,
    lambda_global=0,
    lambda_local=0,
    max_clip_length=STAGES,
    own_stage_only=True,
    dtype="float64",
)


class StartStates:
    """Of each trial, on a level of its own, all states that are not over; and where its next clip begins."""

    def __init__(self, model: Model) -> None:
        """One trial for each of the model's levels."""
        levels = int(model.states.level.max()) + 1
        living = [((model.states.level == n) & ~model.terminal).nonzero().squeeze(1) for n in range(levels)]
        self.count = torch.tensor([len(states) for states in living])
        self.most = int(self.count.max())
        self.states = torch.stack([states.repeat(self.most)[: self.most] for states in living])
        self.model, self.begun = model, torch.zeros(levels, dtype=torch.int64)

    def put(self, state: AgentState) -> AgentState:
        """Put each trial that records no clip where one may begin: in each state twice, for either kind."""
        idle = ~state.recorder.running
        number = (self.begun // 2) % self.count
        self.begun = self.begun + idle
        there = self.states.gather(1, number[:, None]).squeeze(1)
        return state.replace(world=self.model.states.pick(there).where(idle, state.world))


def run_stage(world: Gridworld, judge: ScriptedRule, state: AgentState, starts: StartStates) -> AgentState:
    """Run a stage until it has converged or is given up; each query is answered in the next tick."""
    parent = ScriptedParent(judge, parenting.no_query(world, CONFIG, state))
    stage = int(state.maturity[0])
    for _ in range(ROUNDS):
        for _ in range(2 * stage * starts.most):
            state = parenting.tick(world, CONFIG, starts.put(state), parent).state
        for _ in range(CONVERGING):
            state = learning.train(network_of(world), CONFIG, state, torch.ones_like(state.waiting))
        if bool(converged(world, state, starts).all()):
            break
    return state


def converged(world: Gridworld, state: AgentState, starts: StartStates) -> Bool[Tensor, "N"]:
    """X holds every state with every comparison of the argmax, and the policy agrees with all of X."""
    x, network = state.x, network_of(world)
    with torch.no_grad():
        z = network.heads(network.unpack(state.learner.params), x.s0, x.local_state).logits
    margin = z.gather(1, x.state_index[:, :, None].expand(-1, -1, 4)).gather(2, x.a0).diff(dim=2).squeeze(2)
    leaning = x.mu.diff(dim=2).squeeze(2).sign()
    agreed = (leaning == 0) | (leaning * margin > AGREED)
    best = z.argmax(2).gather(1, x.state_index)
    row = torch.arange(x.state_index.shape[1]) < x.rows[:, None]
    compared = torch.zeros_like(x.digest).scatter_add(
        1, x.state_index, ((x.a0 == best[:, :, None]).any(2) & row).long()
    )
    known = torch.arange(x.digest.shape[1]) < x.states[:, None]
    whole = (x.states == starts.count) & ((compared == 3) | ~known).all(1)
    return whole & (agreed | ~row).all(1)


def parents_policy(model: Model, seed: int) -> Tensor:
    """A random pi_p(a|s), mostly far from optimal: of one action on even levels, of all four on odd ones."""
    generator = torch.Generator().manual_seed(seed)
    drawn = torch.rand(
        len(model.terminal), 4, generator=generator, dtype=torch.float64, device=generator.device
    )
    mixed = drawn.to(model.terminal.device) ** 3
    pure = torch.nn.functional.one_hot(mixed.argmax(1), 4).double()
    return torch.where((model.states.level % 2 == 0)[:, None], pure, mixed / mixed.sum(1, keepdim=True))


def iterated(model: Model, values: ValueTable, stages: int = STAGES) -> list[Tensor]:
    """Value iteration from the parent's values: V_0 = V_p, V_1, ..., V_T (Eq. 10, 11)."""
    found = [values.v]
    for _ in range(stages):
        q = model.reward + values.gamma * found[-1][model.next_state]
        found.append(torch.where(model.terminal, 0.0, q.max(1).values))
    return found


def greedy(model: Model, gamma: float, v: Tensor) -> Bool[Tensor, "S 4"]:
    """The actions that are best for r + gamma v(s')."""
    q = model.reward + gamma * v[model.next_state]
    return q >= q.max(1, keepdim=True).values - TIE


def chosen(world: Gridworld, state: AgentState, starts: StartStates) -> Int64[Tensor, "N P"]:
    """The argmax of each trial's live policy in each of its places."""
    network, now = network_of(world), starts.model.states.pick(starts.states.flatten())
    seen = world.observe(now.board, now.agent, now.box)
    near, shape = local_state(seen, now.agent), starts.states.shape
    with torch.no_grad():
        layers = network.unpack(state.learner.params)
        heads = network.heads(layers, seen.view(*shape, *seen.shape[1:]), near.view(*shape, 4))
    return heads.logits.argmax(2)


def among(best: Bool[Tensor, "N P 4"], action: Int64[Tensor, "N P"]) -> Bool[Tensor, "N P"]:
    """Where an action is one of the best."""
    return best.gather(2, action[..., None]).squeeze(2)
