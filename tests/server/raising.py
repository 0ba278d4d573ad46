"""Runs of one agent with and without the database, and their states compared bit for bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Literal, NamedTuple

import httpx2
import torch

from parenting.agent import parenting
from parenting.agent.config import Config, compose
from parenting.agent.events import EndEpisode, Event
from parenting.agent.init import world_of
from parenting.agent.query import Choice
from parenting.agent.state import AgentState
from parenting.commands.answering import Answering, Order
from parenting.commands.client import Client
from parenting.commands.judge import Judge as Script
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.parents.scripted import ScriptedParent, ScriptedRule
from parenting.server.checkpoints import load_checkpoints
from parenting.server.codec import CHOICE_NAMES
from parenting.server.counters import count
from parenting.server.db import Database
from parenting.server.new_run import NewRun
from parenting.server.replay import differences
from parenting.server.snapshot import Snapshot, initial_snapshot, unpack
from parenting.weights.store import Wanted, find, load
from tests.agent.batched_runs import Judge, Judged

CONFIG: dict[str, Any] = {"stages": 3, "mature_every": 12, "max_open_preferences": 0, "time_limit": 12}
"""Clips of up to three steps, early ends, truncations and two maturations within some sixty answers."""
SEED = 11


class Begun(NamedTuple):
    """The settings that a run is started with, worked out here and not by the server."""

    world: str
    level: str
    changes: Mapping[str, Any]
    preset: str = "lax"
    seed: int = SEED

    def new(self, parent: Literal["human", "scripted"], goal: int | None = None) -> NewRun:
        """The same for the server."""
        kept = {"world": self.world, "level": self.level, "preset": self.preset, "seed": self.seed}
        return NewRun(**kept, config=dict(self.changes), parent=parent, goal=goal)  # type: ignore[arg-type]

    @property
    def config(self) -> Config:
        return compose(self.preset, registry.defaults(self.world), self.changes, strict=True)

    def make(self) -> Gridworld:
        """The world that the run lives in."""
        return world_of(self.world, self.level, self.config)

    def weights(self) -> torch.Tensor | None:
        """The shipped weights, where the run begins with some."""
        world = self.make()
        wanted = Wanted(world.spec, world.height, world.width)
        return load(find(wanted).read_bytes(), wanted) if self.config.pretrain else None

    def initial_snapshot(self, seed: int | None = None) -> Snapshot:
        """The run at tick 0, with its own seed or another."""
        return initial_snapshot(self.make(), self.config, self.seed if seed is None else seed, self.weights())

    def unpack(self, blob: bytes) -> Snapshot:
        """A checkpoint of the run."""
        return unpack(self.make(), self.config, blob)


ISLAND = Begun("unsafe-exploration", "island", CONFIG)


class Inline(ScriptedParent):
    """The run without a database, and its parent: the scripted one, or another function of the query.

    It ends hopeless episodes.
    """

    def __init__(self, begun: Begun = ISLAND, seed: int | None = None, judge: Judge | None = None) -> None:
        self.world, self.config = begun.make(), begun.config
        scripted = ScriptedRule(self.world, self.config.gamma, inside=self.config.garden_parent)
        self.saved = begun.initial_snapshot(seed)
        nothing = parenting.no_query(self.world, self.config, self.saved.state)
        super().__init__(Judged(judge) if judge else scripted, nothing)
        self.heard: list[tuple[int, str]] = []  # the tick at which an answer was heard, and what it was

    def events(self, state: AgentState) -> Sequence[Event]:
        return [EndEpisode()] if bool(state.all_refused | state.unsure) else []

    def tick(self) -> None:
        state, tally, config = self.saved
        state, _, answer, config, events = parenting.tick(self.world, config, state, self)
        if bool(answer.choice != Choice.NONE):
            self.heard.append((int(state.keys.tick), CHOICE_NAMES[int(answer.choice)]))
        self.saved = Snapshot(state, count(self.world, tally, answer, state, events), config)


def inline(ticks: int, begun: Begun = ISLAND) -> Snapshot:
    """The state of the run after `ticks` ticks; that of the island is lived once a process."""
    return _lived(ticks) if begun is ISLAND else lived(ticks, begun)


def lived(ticks: int, begun: Begun) -> Snapshot:
    """Live a run of its own."""
    run = Inline(begun)
    for _ in range(ticks):
        run.tick()
    return run.saved


@cache
def _lived(ticks: int) -> Snapshot:
    return lived(ticks, ISLAND)


def last(db: Database, run_id: int, begun: Begun = ISLAND) -> Snapshot:
    """The newest checkpoint of a run."""
    newest = load_checkpoints(db, run_id)[0]
    assert newest.intact
    return begun.unpack(newest.blob)


def same_bits(one: Snapshot, other: Snapshot) -> list[str]:
    """The names of the pieces of state that differ; the report is none."""
    return differences(one, other)


def script(web: httpx2.Client, run: int) -> Answering:
    """`parenting answer`, in this process and before an application in it."""
    return Answering(Client("http://localhost", web), Order(run), Script(), lambda receipt: None)
