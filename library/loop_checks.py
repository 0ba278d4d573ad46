"""Checks of what a loop of one's own hands to `step` and `tick`."""

from __future__ import annotations

from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.query import Answer, Choice
from parenting.agent.state import AgentState
from parenting.library.worlds import World


def check_agents(world: object, config: object, state: object) -> None:
    """Refuse a world, config or state that is none, and a state that does not fit the other two.

    Raises:
        TypeError: an argument is of another type.
        ValueError: the state is of another world, or of a config with other clips.
    """
    if not isinstance(world, World):
        raise TypeError(f"world: {world!r} is not a World. Make one with pt.make(name).")
    known = check_config(config)
    if not isinstance(state, AgentState):
        raise TypeError(f"state: {state!r} is not the state of agents. Make one with pt.init(world, config).")
    board, parameters = state.world.board.shape[1:], state.learner.params.shape[1]
    if board != (world.height, world.width) or parameters != network_of(world).size:
        raise ValueError(
            f"state: its agents live on {board[0]} x {board[1]} cells of another world, and this is"
            f" {world.name} on {world.height} x {world.width}. Give the world that pt.init was given."
        )
    if int(state.world.level.max()) >= len(world.levels):
        raise ValueError(f"state: an agent lives on a level that {world!r} does not have.")
    length = state.recorder.clip.action.shape[-1]
    if length != known.max_clip_length:
        raise ValueError(
            f"config: max_clip_length is {known.max_clip_length}, and this state was made for {length}."
            " Give the config that pt.init was given."
        )


def check_config(config: object) -> Config:
    """Return a config; refuse what is not one.

    Raises:
        TypeError: the message names what was given.
    """
    if not isinstance(config, Config):
        raise TypeError(f"config: {config!r} is not a Config. Compose one with pt.configure(world).")
    return config


def check_answer(answer: object, state: AgentState, nothing: Tensor) -> None:
    """Refuse what is not one answer for each agent.

    Args:
        answer: The answer.
        state: N agents.
        nothing: Boards [N, 2, T+1, H, W] of a query of these agents.

    Raises:
        TypeError: it is not an `Answer` of tensors.
        ValueError: it is for another number of agents, or holds a choice that does not exist.
    """
    if not isinstance(answer, Answer) or not isinstance(answer.choice, Tensor):
        raise TypeError(
            f"answer: {answer!r} is not an Answer. Give pt.Answer(query=query, choice=torch.tensor([...]))"
            " with a pt.Choice for each agent, or None for silence."
        )
    trials = len(state.waiting)
    if answer.choice.shape != (trials,) or answer.query.board.shape != nothing.shape:
        raise ValueError(
            f"answer: choice has shape {tuple(answer.choice.shape)} and its query"
            f" {len(answer.query.kind)} rows; there must be one for each of {trials} agents of this world."
        )
    if answer.choice.is_floating_point() or not bool(
        ((answer.choice >= 0) & (answer.choice <= max(Choice))).all()
    ):
        known = ", ".join(f"{int(choice)} {choice.name.lower()}" for choice in Choice)
        raise ValueError(f"answer: choice {answer.choice.tolist()} must hold whole numbers of {known}.")
