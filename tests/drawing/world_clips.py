"""Clips filmed in the worlds themselves: what happens in them is what their rules do."""

from __future__ import annotations

from typing import Any

from torch import tensor

from parenting.drawing.clip import Clip, Frame
from parenting.drawing.query_tensors import ACTIONS
from parenting.drawing.query_view import QueryView, query_view
from parenting.envs import registry
from parenting.envs.art import draw
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.walk import LETTERS, states


def walked_clip(world: Gridworld, letters: str, way: str = "", seed: int = 0) -> Clip:
    """Play `letters` after the agent has gone a way, until its episode ends or it is held."""
    passed = states(world, way + letters, seed)[len(way) :]
    last = next((k for k, state in enumerate(passed) if _ended(world, state)), len(letters))
    frames = [frame(world, state) for state in passed[: last + 1]]
    return {"actions": _names(letters[:last]), "length": last, "frames": frames}


def forecast(world: Gridworld, letter: str, way: str = "", seed: int = 0) -> Clip:
    """The move as a guidance query shows it: the same without chance."""
    now = states(world, way, seed)[-1]
    then = world.forecast(now, tensor([LETTERS.index(letter)]))
    return {"actions": _names(letter), "length": 1, "frames": [frame(world, now), frame(world, then)]}


def frame(world: Gridworld, state: WorldState) -> Frame:
    """A moment as it is stored."""
    seen = world.observe(state.board, state.agent, state.box)
    box = state.box[0].tolist()
    return {
        "ground": list(draw(state.board[0].tolist(), world.legend)),
        "observed": list(draw(seen[0].tolist(), world.legend)),
        "agent": state.agent[0].tolist(),
        "box": None if box[0] < 0 else box,
    }


def guidance(world: Gridworld, left: str, right: str, way: str = "", seed: int = 0) -> dict[str, Any]:
    """Two moves from one place."""
    return {"left": forecast(world, left, way, seed), "right": forecast(world, right, way, seed)}


def preference(world: Gridworld, left: str, right: str, way: str = "", seed: int = 0) -> dict[str, Any]:
    """Two clips from one place."""
    return {"left": walked_clip(world, left, way, seed), "right": walked_clip(world, right, way, seed)}


def view(kind: str, clips: dict[str, Any], world: str, level: str | None = None, stage: int = 1) -> QueryView:
    """A query that holds these clips, as it is shown."""
    return query_view(clips, kind, stage, registry.spec(world).legend, registry.level(world, level).rows)


def _ended(world: Gridworld, state: WorldState) -> bool:
    return bool(state.terminated[0]) or bool(world.frozen(state)[0])


def _names(letters: str) -> list[str]:
    return [ACTIONS[LETTERS.index(letter)] for letter in letters]
