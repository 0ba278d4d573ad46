"""PARENTING (Sec. 2): start reading here.

The agent is a pure step over stacked trials; the parent is a mailbox outside it. `step` reads no reward, no
clock, no file and no global seed. A run is a function of (config, seed, answers, the operator's events).

`step` consumes its state: the buffers of policy, recorder, X and familiarity are updated in place, so that a
tick costs what it changes. Whoever wants to keep an earlier state keeps `state.clone()`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import torch

from parenting.agent import (
    amendment,
    confirmation,
    guidance,
    learning,
    maturation,
    pairing,
    pretraining,
    recording,
)
from parenting.agent import query as queries
from parenting.agent.amendment import Amend, Reconsider, TickEvent
from parenting.agent.config import Config
from parenting.agent.events import Change, EndEpisode, Mature
from parenting.agent.guidance import View
from parenting.agent.init import init, network_of, no_info
from parenting.agent.parent import Parent
from parenting.agent.policy import Network
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState
from parenting.agent.untracked import untracked
from parenting.envs.gridworld import Gridworld, local_state

__all__ = ["Tick", "apply", "init", "no_query", "rehearse", "step", "tick"]


def step(world: Gridworld, config: Config, state: AgentState, answer: Answer) -> tuple[AgentState, Query]:
    """Make one tick of PARENTING for every trial (Sec. 2). It reads no reward and does no I/O.

    Args:
        world: The world that the agents live in, as `init.world_of` makes it for this config.
        config: The hyperparameters.
        state: N agents, as `init` or an earlier step left them. The step consumes it: buffers of policy,
            recorder, X and familiarity are changed in place. Pass `state.clone()` to keep the state itself.
        answer: At most one answer for each trial, to the query of an earlier tick; `query.silence` is none.

    Returns:
        The agents after the tick, and what each trial asks in it: at most one question. Where
        `config.pretrain` or `config.late_steps` is set, call `rehearse` on the agents next, as `tick` does.
    """
    with untracked():
        return _step(world, config, state, answer)


def _step(world: Gridworld, config: Config, state: AgentState, answer: Answer) -> tuple[AgentState, Query]:
    network = network_of(world)
    state = reset_finished(world, state)
    view = observe(world, network, state)
    query = no_query(world, config, state)
    state, heard = guidance.hear(config, state, view, answer)  # 2.1  answers enter X; "neither": ask again
    state, heard, query = guidance.ask(world, config, state, view, heard, query)  # 2.1  unfamiliar? ask
    state, steered = recording.act(world, network, config, state, view, heard)  # 2.2, 2.4  move, and clips
    state, query = pairing.pair(world, config, state, view, steered, query)  # 2.2  a matching pair of clips
    state = learning.train(network, config, state, steered)  # 2.3  gradient steps on X with p_train
    return maturation.grow(config, state), query  # 2.4  pi_T -> pi_{T+1}


class Tick(NamedTuple):
    """The result of one tick with a parent."""

    state: AgentState  # after the tick; `state.info` records what it did
    query: Query  # what each trial asks in it
    answer: Answer  # what each trial heard in it
    config: Config  # as the operator's events left it
    events: Sequence[TickEvent]  # what applied before it


def tick(world: Gridworld, config: Config, state: AgentState, parent: Parent) -> Tick:
    """Make one tick with a parent: its events, its answer, a step, the question; then what is owed.

    The step on mazes (Sec. 3.1.4) and the gradient steps of `late_steps` come after the question is posted,
    so nobody waits for them. Consumes `state`.

    Args:
        world: The world that the agents live in.
        config: The hyperparameters.
        state: N agents, as `init` or an earlier tick left them.
        parent: Whoever answers; see `agent.parent`.

    Returns:
        The agents, what they ask and what they heard: N trials each. Pass `state` and `config` on to the next
        tick.
    """
    events = parent.events(state)
    for event in events:
        state, config = apply(world, config, state, event)
    answer = parent.take(state)
    state, query = step(world, config, state, answer)
    parent.post(query)
    return Tick(rehearse(world, config, state), query, answer, config, events)


def rehearse(world: Gridworld, config: Config, state: AgentState) -> AgentState:
    """Take the steps that the tick before owes: on X where the agent waits, and on mazes (Sec. 3.1.4).

    Consumes `state`.
    """
    network = network_of(world)
    state = learning.pay(network, config, state, state.waiting)
    return pretraining.rehearse(world, network, config, state)


def apply(world: Gridworld, config: Config, state: AgentState, event: TickEvent) -> tuple[AgentState, Config]:
    """An operator's event or a correction, in every trial, before a tick."""
    match event:
        case Mature():
            return maturation.mature(config, state, torch.ones_like(state.waiting)), config
        case EndEpisode():
            ended = state.world.replace(step_count=torch.full_like(state.world.step_count, world.time_limit))
            calm = torch.zeros_like(state.waiting)
            nothing = {name: torch.zeros_like(getattr(state, name)) for name in ("refused", "set_aside")}
            votes = confirmation.forget(state.confirmation)
            return state.replace(world=ended, waiting=calm, confirmation=votes, **nothing), config
        case Change(name=name, value=value):
            return state, config.model_copy(update={name: value})
        case Amend():
            return amendment.amend(config, state, event), config
        case Reconsider():
            return amendment.reconsider(config, state, event), config


def reset_finished(world: Gridworld, state: AgentState) -> AgentState:
    """Draw the keys of a new tick, and reset episodes that have ended, each on its next level."""
    state = state.replace(keys=state.keys.next(), info=no_info(state.world, state.learner.params.dtype))
    ended = state.world.terminated | world.truncated(state.world)
    if not bool(ended.any()):
        return state
    level = torch.where(ended, (state.world.level + 1) % len(world.levels), state.world.level)
    recorder = state.recorder.replace(running=state.recorder.running & ~ended)
    return state.replace(world=world.reset(state.keys, level).where(ended, state.world), recorder=recorder)


def observe(world: Gridworld, network: Network, state: AgentState) -> View:
    """Return each trial's observation and its policy there."""
    here = state.world
    observation = world.observe(here.board, here.agent, here.box)
    near = local_state(observation, here.agent)
    active = ~world.frozen(here)
    return View(
        observation=observation,
        local_state=near,
        policy=lambda: network.logits(state.learner.params, observation, near),
        active=active,
        supervised=active & world.supervised(here),
    )


def no_query(world: Gridworld, config: Config, state: AgentState) -> Query:
    """No question in any trial, for clips of up to `max_clip_length` steps."""
    return queries.empty(
        len(state.waiting), config.max_clip_length, world.height, world.width, state.waiting.device
    )
