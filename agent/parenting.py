"""PARENTING (Sec. 2): start reading here.

The agent is a pure step over stacked trials; the parent is a mailbox outside it. `step` reads no reward, no
clock, no file and no global seed. A run is a function of (config, seed, answers, the operator's events).

`step` consumes its state: the buffers of policy, recorder, X and familiarity are updated in place, so that a
tick costs what it changes. Whoever wants to keep an earlier state keeps `state.clone()`.
"""

from __future__ import annotations

from collections.abc import Iterator

import torch

from parenting.agent import guidance, learning, maturation, pairing, pretraining, recording
from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.events import Change, EndEpisode, Event, Mature
from parenting.agent.guidance import View
from parenting.agent.init import init, network_of, no_info
from parenting.agent.mailbox import Mailbox
from parenting.agent.policy import Network
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld, local_state

__all__ = ["apply", "init", "live", "no_query", "rehearse", "step", "tick"]


def step(world: Gridworld, config: Config, state: AgentState, answer: Answer) -> tuple[AgentState, Query]:
    """One tick of PARENTING for every trial (Sec. 2). Reads no reward, does no I/O. Consumes `state`."""
    network = network_of(world)
    state = reset_finished(world, state)
    view = observe(world, network, state)
    query = no_query(world, config, state)
    state, heard = guidance.hear(config, state, answer)  # 2.1  answers enter X; "neither": ask again
    state, query = guidance.ask(world, config, state, view, heard, query)  # 2.1  unfamiliar? pause and ask
    state, steered = recording.act(world, network, config, state, view, heard)  # 2.2, 2.4  move, and clips
    state, query = pairing.pair(world, config, state, view, steered, query)  # 2.2  a matching pair of clips
    state = learning.train(network, config, state, steered)  # 2.3  gradient steps on X with p_train
    return maturation.grow(config, state), query  # 2.4  pi_T -> pi_{T+1}


def tick(
    world: Gridworld, config: Config, state: AgentState, parent: Mailbox
) -> tuple[AgentState, Config, Query]:
    """One tick with its parent: the operator's events, an answer, a step, a question; then mazes."""
    for event in parent.events(state):
        state, config = apply(world, config, state, event)
    state, query = step(world, config, state, parent.take(state))
    parent.post(query)
    return rehearse(world, config, state), config, query


def rehearse(world: Gridworld, config: Config, state: AgentState) -> AgentState:
    """The step of pre-training that the tick before owes (Sec. 3.1.4). Consumes `state`."""
    return pretraining.rehearse(world, network_of(world), config, state)


def live(
    world: Gridworld, config: Config, state: AgentState, parent: Mailbox
) -> Iterator[tuple[AgentState, Config, Query]]:
    """A life, one item a tick; whoever iterates decides when the next may be."""
    while True:
        state, config, query = tick(world, config, state, parent)
        yield state, config, query


def apply(world: Gridworld, config: Config, state: AgentState, event: Event) -> tuple[AgentState, Config]:
    """An operator's event, in every trial, before a tick."""
    match event:
        case Mature():
            return maturation.mature(config, state, torch.ones_like(state.waiting)), config
        case EndEpisode():
            ended = state.world.replace(step_count=torch.full_like(state.world.step_count, world.time_limit))
            calm = torch.zeros_like(state.waiting)
            return state.replace(world=ended, waiting=calm, refused=torch.zeros_like(state.refused)), config
        case Change(name=name, value=value):
            return state, config.model_copy(update={name: value})


def reset_finished(world: Gridworld, state: AgentState) -> AgentState:
    """The keys of a new tick; episodes that have ended start anew, each on its next level."""
    state = state.replace(keys=state.keys.next(), info=no_info(state.world, state.learner.params.dtype))
    ended = state.world.terminated | world.truncated(state.world)
    if not bool(ended.any()):
        return state
    level = torch.where(ended, (state.world.level + 1) % len(world.levels), state.world.level)
    recorder = state.recorder.replace(running=state.recorder.running & ~ended)
    return state.replace(world=world.reset(state.keys, level).where(ended, state.world), recorder=recorder)


def observe(world: Gridworld, network: Network, state: AgentState) -> View:
    """What each trial sees, and its policy's logits there."""
    here = state.world
    observation = world.observe(here.board, here.agent, here.box)
    near = local_state(observation, here.agent)
    active = ~world.frozen(here)
    return View(
        observation=observation,
        local_state=near,
        logits=network.logits(state.learner.params, observation, near),
        active=active,
        supervised=active & world.supervised(here),
    )


def no_query(world: Gridworld, config: Config, state: AgentState) -> Query:
    """No question in any trial, for clips of up to `stages` steps."""
    return queries.empty(len(state.waiting), config.stages, world.height, world.width, state.waiting.device)
