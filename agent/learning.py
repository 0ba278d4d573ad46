"""Direct policy learning: pi is trained to predict the parent's preferred actions (Sec. 2.3, Eq. 2)."""

from __future__ import annotations

from typing import NamedTuple

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float, Int64, UInt8
from torch import Tensor

from parenting.agent import backpropagation
from parenting.agent.adam import Adam
from parenting.agent.config import Config
from parenting.agent.dataset import Dataset
from parenting.agent.policy import Affine, Heads, Network, Seen, Trace
from parenting.agent.state import AgentState
from parenting.agent.untracked import untracked
from parenting.envs.giving_way import give_way
from parenting.envs.rng import Keys, Stream


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
    told = {name: total / entries for name, total in terms._asdict().items()}
    if len(trial) < len(training):
        told = {name: mean.new_zeros(len(training)).index_put((trial,), mean) for name, mean in told.items()}
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
    """Take the gradient steps of these numbers, in place; the terms before the last one, and the entries.

    What the steps share is made once: the rows, unless each step draws its own, and where all trials train
    the layers, which are views of the parameters that Adam moves.
    """
    trial = training.nonzero().squeeze(1)
    params, optimiser = state.learner.params, Adam(state.learner.params, state.learner, training)
    with untracked():
        for step in steps:
            give_way()
            if step == steps.start or draws(config, state.x):
                rows = choose(config, state.x, state.keys, step).of(trial)
                lesson = prepare(network, config, rows, params.dtype)
            if step == steps.start or len(trial) < len(params):
                layers = network.unpack(taken(params, trial))
            trace, found = forward_pass(network, layers, lesson)
            gradient = backpropagation.gradient(network, layers, trace, found.by_heads(lesson))
            optimiser.step(gradient, config.learning_rate)
        return found.terms(lesson), rows.mu.sum((-1, -2)).clamp_min(1)


def taken(every: Tensor, trial: Int64[Tensor, "K"]) -> Tensor:
    """The rows of some trials, in order; no copy if it is all of them."""
    return every if len(trial) == len(every) else every[trial]


def draws(config: Config, x: Dataset) -> bool:
    """Return True where each step draws `batch_size` of the rows, which are more than that."""
    return config.batch_size is not None and int(x.rows.max()) > config.batch_size


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


class Lesson(NamedTuple):
    """Rows of X as a gradient step takes them: all of it that does not depend on the parameters."""

    seen: Seen
    mu: tuple[Float[Tensor, "N R"], Float[Tensor, "N R"]]
    place: Int64[Tensor, "N 2R"]  # of each row's two first actions among a trial's logits
    weight: Float[Tensor, "N S"]
    factor: Float[Tensor, "2 N S 1"]  # the weight times lambda_local and times lambda_global


def prepare(network: Network, config: Config, rows: Rows, dtype: torch.dtype) -> Lesson:
    """Rows of X as a gradient step takes them."""
    one, other = rows.mu.to(dtype).movedim(-1, 0).contiguous().unbind(0)
    weight = rows.weight.to(dtype)
    return Lesson(
        seen=network.see(rows.s0, rows.local_state, dtype),
        mu=(one, other),
        place=places(rows),
        weight=weight,
        factor=torch.stack((weight * config.lambda_local, weight * config.lambda_global)).unsqueeze(-1),
    )


def places(rows: Rows) -> Int64[Tensor, "N 2R"]:
    """The places of each row's two first actions among a trial's logits, one after the other."""
    return (4 * rows.state_index.unsqueeze(-1) + rows.a0).flatten(1)


def differentiate(
    network: Network, config: Config, parameters: Float[Tensor, "N P"], rows: Rows
) -> tuple[Terms, Float[Tensor, "N P"]]:
    """The terms of the objective and its gradient, each trial's by itself."""
    with torch.no_grad():
        layers, lesson = network.unpack(parameters), prepare(network, config, rows, parameters.dtype)
        trace, found = forward_pass(network, layers, lesson)
        gradient = backpropagation.gradient(network, layers, trace, found.by_heads(lesson))
        return found.terms(lesson), gradient


class Pass(NamedTuple):
    """The results of one forward pass from which the objective and its derivatives follow."""

    logits: Float[Tensor, "N S 4"]  # of pi
    margin: Float[Tensor, "N R"]
    logs: Float[Tensor, "2 N S 4"]  # the logarithms of the softmax of the local and of the global head
    chances: Float[Tensor, "2 N S 4"]

    def by_heads(self, lesson: Lesson) -> Heads:
        """The derivative of loss - lambda_global H_global - lambda_local H_local by both heads' logits."""
        margin = backpropagation.by_margin(self.margin, lesson.mu)
        half = backpropagation.by_logits(margin, self.logits, lesson.place) / 2
        return Heads(*(half + backpropagation.by_entropy(self.logs, self.chances, lesson.factor)).unbind(0))

    def terms(self, lesson: Lesson) -> Terms:
        """The terms of the objective."""
        one, other = lesson.mu
        loss = one * F.softplus(-self.margin) + other * F.softplus(self.margin)
        local, overall = (lesson.weight * -(self.chances * self.logs).sum(-1)).sum(-1).unbind(0)
        return Terms(loss=loss.sum(-1), entropy_global=overall, entropy_local=local)


def forward_pass(network: Network, layers: list[Affine], lesson: Lesson) -> tuple[Trace, Pass]:
    """One pass through the network, and what it tells of the objective.

    With logits z, pi(a_i) / (pi(a_0) + pi(a_1)) is sigmoid(z[a_i] - z[a_other]), and -log of it a softplus.
    """
    trace = network.trace(layers, lesson.seen)
    logits = trace.heads.logits
    logs = torch.stack(trace.heads).log_softmax(-1)
    return trace, Pass(logits, _margin(logits, lesson.place), logs, logs.exp())


def _margin(logits: Float[Tensor, "N S 4"], place: Int64[Tensor, "N 2R"]) -> Float[Tensor, "N R"]:
    """z[a_0] - z[a_1] in each row."""
    left, right = logits.flatten(1).gather(1, place).view(len(place), -1, 2).unbind(-1)
    return left - right


def objective(heads: Heads, rows: Rows) -> Terms:
    """Eq. (2) and the two entropies, at the first states of the entries: what autograd can differentiate."""
    mu, weight = rows.mu.to(heads.local.dtype), rows.weight.to(heads.local.dtype)
    margin = _margin(heads.logits, places(rows))
    loss = mu[..., 0] * F.softplus(-margin) + mu[..., 1] * F.softplus(margin)
    return Terms(
        loss=loss.sum(-1),
        entropy_global=(weight * entropy(heads.overall)).sum(-1),
        entropy_local=(weight * entropy(heads.local)).sum(-1),
    )


def entropy(logits: Float[Tensor, "N S 4"]) -> Float[Tensor, "N S"]:
    """The entropy of softmax(logits), in nats."""
    logs = logits.log_softmax(-1)
    return -(logs.exp() * logs).sum(-1)
