"""Direct policy learning: pi is trained to predict the parent's preferred actions (Sec. 2.3, Eq. 2)."""

from __future__ import annotations

from itertools import compress
from typing import NamedTuple, Protocol

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, Int64, UInt8
from torch import Tensor
from torch.optim.adam import adam as fused_adam

from parenting.agent import backpropagation
from parenting.agent.config import Config
from parenting.agent.dataset import Dataset
from parenting.agent.policy import Heads, Network
from parenting.agent.state import AgentState
from parenting.envs.giving_way import give_way
from parenting.envs.rng import Keys, Stream

BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8  # Adam's default parameters (Sec. 3.1.2)


class Rows(NamedTuple):
    """The rows of X in one gradient step, trimmed to what the fullest trial needs."""

    s0: UInt8[Tensor, "N S H W"]
    local_state: UInt8[Tensor, "N S 4"]
    state_index: Int64[Tensor, "N R"]
    a0: Int64[Tensor, "N R 2"]
    mu: Float[Tensor, "N R 2"]

    @property
    def weight(self) -> Float[Tensor, "N S"]:
        """The number of entries that start at each state."""
        entries = self.mu.sum(-1)
        return entries.new_zeros(self.local_state.shape[:2]).scatter_add_(1, self.state_index, entries)

    def of(self, trial: Int64[Tensor, "K"]) -> Rows:
        """Those of some trials, in order."""
        return Rows(*(taken(part, trial) for part in self))


class Terms(NamedTuple):
    """The terms of the objective, each summed over the entries of X."""

    loss: Float[Tensor, "N"]
    entropy_global: Float[Tensor, "N"]
    entropy_local: Float[Tensor, "N"]


def train(network: Network, config: Config, state: AgentState, acted: Bool[Tensor, "N"]) -> AgentState:
    """With probability p_train, `gradient_steps` steps of Adam on X. Updates the learner in place.

    With `late_steps` it takes one of them, and owes the others.
    """
    coin = state.keys.uniform(Stream.TRAIN) < config.p_train
    training = acted & coin & (state.x.rows > 0)
    trial = training.nonzero().squeeze(1)
    if not len(trial):
        return state
    state = pay(network, config, state, training)
    late = config.late_steps and config.gradient_steps > 1
    terms, entries = descend(network, config, state, training, range(1 if late else config.gradient_steps))
    means = {name: total / entries for name, total in terms._asdict().items()}
    told = {name: mean.new_zeros(len(training)).index_put((trial,), mean) for name, mean in means.items()}
    if late:
        state = state.replace(learner=state.learner.replace(owed=state.learner.owed | training))
    return state.replace(info=state.info.replace(trained=training, **told))


def pay(network: Network, config: Config, state: AgentState, due: Bool[Tensor, "N"]) -> AgentState:
    """Take the gradient steps that some trials owe (`late_steps`). Updates the learner in place."""
    if not config.late_steps:
        return state
    due = due & state.learner.owed
    if not bool(due.any()):
        return state
    taking = due & (state.x.rows > 0)  # answers that were taken back may leave nothing to train on
    if bool(taking.any()):
        descend(network, config, state, taking, range(1, config.gradient_steps))
    return state.replace(learner=state.learner.replace(owed=state.learner.owed & ~due))


def descend(
    network: Network, config: Config, state: AgentState, training: Bool[Tensor, "N"], steps: range
) -> tuple[Terms, Float[Tensor, "K"]]:
    """Take the gradient steps of these numbers, in place; the terms before the last one, and the entries."""
    trial = training.nonzero().squeeze(1)
    for step in steps:
        give_way()
        rows = choose(config, state.x, state.keys, step).of(trial)
        parameters = taken(state.learner.params, trial)
        terms, gradient = differentiate(network, config, parameters, rows)
        adam(state.learner.params, state.learner, gradient, training, config.learning_rate)
    return terms, rows.mu.sum((-1, -2)).clamp_min(1)


def taken(every: Tensor, trial: Int64[Tensor, "K"]) -> Tensor:
    """The rows of some trials, in order; no copy if it is all of them."""
    return every if len(trial) == len(every) else every[trial]


def choose(config: Config, x: Dataset, keys: Keys, step: int) -> Rows:
    """All rows of X, or `batch_size` of them drawn by key without replacement."""
    rows, states = max(1, int(x.rows.max())), max(1, int(x.states.max()))
    at, a0, mu = x.state_index[:, :rows], x.a0[:, :rows], x.mu[:, :rows]
    if config.batch_size is None or rows <= config.batch_size:
        return Rows(x.s0[:, :states], x.local_state[:, :states], at, a0, mu)
    place = torch.arange(rows, device=at.device)
    noise = keys.at(Stream.BATCH, 65536 * step + place).masked_fill(place >= x.rows[:, None], 2.0)
    picked = noise.topk(config.batch_size, dim=1, largest=False).indices
    both = picked[:, :, None].expand(-1, -1, 2)
    state = at.gather(1, picked)
    every = torch.arange(len(at), device=at.device)[:, None]
    own = torch.arange(config.batch_size, device=at.device).expand_as(state)
    return Rows(x.s0[every, state], x.local_state[every, state], own, a0.gather(1, both), mu.gather(1, both))


def differentiate(
    network: Network, config: Config, parameters: Float[Tensor, "N P"], rows: Rows
) -> tuple[Terms, Float[Tensor, "N P"]]:
    """The terms of the objective and its gradient, each trial's by itself."""
    with torch.no_grad():
        layers = network.unpack(parameters)
        trace = network.trace(layers, rows.s0, rows.local_state)
        found = forward_pass(trace.heads, rows)
        return found.terms, backpropagation.gradient(network, layers, trace, found.by_heads(config))


class Pass(NamedTuple):
    """The terms of one forward pass, and what their derivatives need."""

    terms: Terms
    mu: Float[Tensor, "N R 2"]
    at: Int64[Tensor, "N R 4"]  # each row's state, for every action
    a0: Int64[Tensor, "N R 2"]
    margin: Float[Tensor, "N R"]
    weight: Float[Tensor, "N S"]
    logs: Heads  # the logarithms of each head's softmax

    def by_heads(self, config: Config) -> Heads:
        """The derivative of loss - lambda_global H_global - lambda_local H_local by both heads' logits."""
        margin = backpropagation.by_margin(self.margin, self.mu)
        half = backpropagation.by_logits(margin, self.logs.local, self.at, self.a0) / 2
        by_local = backpropagation.by_entropy(self.logs.local, self.weight, config.lambda_local)
        by_overall = backpropagation.by_entropy(self.logs.overall, self.weight, config.lambda_global)
        return Heads(half + by_local, half + by_overall)


def objective(heads: Heads, rows: Rows) -> Terms:
    """Eq. (2) and the two entropies, at the first states of the entries.

    With logits z, pi(a_i) / (pi(a_0) + pi(a_1)) is sigmoid(z[a_i] - z[a_other]), and -log of it a softplus.
    """
    return forward_pass(heads, rows).terms


def forward_pass(heads: Heads, rows: Rows) -> Pass:
    """The same, with what its derivatives need."""
    mu = rows.mu.to(heads.local.dtype)
    at = rows.state_index[:, :, None].expand(-1, -1, 4)
    z = heads.logits.gather(1, at).gather(2, rows.a0)
    margin = z[..., 0] - z[..., 1]
    loss = mu[..., 0] * F.softplus(-margin) + mu[..., 1] * F.softplus(margin)
    weight = rows.weight.to(heads.local.dtype)
    logs = Heads(heads.local.log_softmax(-1), heads.overall.log_softmax(-1))
    terms = Terms(
        loss=loss.sum(-1),
        entropy_global=(weight * _entropy(logs.overall)).sum(-1),
        entropy_local=(weight * _entropy(logs.local)).sum(-1),
    )
    return Pass(terms, mu, at, rows.a0, margin, weight, logs)


def entropy(logits: Float[Tensor, "N S 4"]) -> Float[Tensor, "N S"]:
    """The entropy of softmax(logits), in nats."""
    return _entropy(logits.log_softmax(-1))


def _entropy(logs: Float[Tensor, "N S 4"]) -> Float[Tensor, "N S"]:
    return -(logs.exp() * logs).sum(-1)


class AdamState(Protocol):
    """The moments that Adam keeps between its steps."""

    @property
    def exp_avg(self) -> Float[Tensor, "N P"]:
        """The running mean of the gradient."""
        ...

    @property
    def exp_avg_sq(self) -> Float[Tensor, "N P"]:
        """The running mean of its square."""
        ...

    @property
    def steps(self) -> Int64[Tensor, "N"]:
        """Steps taken."""
        ...


def adam(
    params: Float[Tensor, "N P"],
    moments: AdamState,
    gradient: Float[Tensor, "K P"],
    training: Bool[Tensor, "N"],
    rate: float,
) -> None:
    """Take one step of Adam (Kingma & Ba 2014) in the K trials that train; change nothing in the others.

    torch's fused step passes over the parameters once. It receives each trial as a tensor of its own, because
    each has taken its own number of steps.

    Args:
        params: The parameters of all N trials; changed in place.
        moments: What Adam remembers of all N trials; changed in place.
        gradient: The gradients of the K trials that train, in order.
        training: Which trials train: K of N.
        rate: The step size.
    """
    chosen = training.tolist()

    def rows(every: Tensor) -> list[Tensor]:
        return list(compress(every.unbind(), chosen))

    fused_adam(
        rows(params),
        list(gradient.unbind()),
        rows(moments.exp_avg),
        rows(moments.exp_avg_sq),
        [],
        rows(moments.steps.to(torch.float32)),  # it counts this step by itself
        fused=True,
        lr=rate,
        beta1=BETA1,
        beta2=BETA2,
        weight_decay=0.0,
        eps=EPSILON,
        amsgrad=False,
        maximize=False,
    )
    moments.steps.add_(training)
