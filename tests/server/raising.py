"""Runs of one agent with and without the database, and their states compared bit for bit."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch

from agent import parenting
from agent.config import PRESETS, Config
from agent.events import EndEpisode
from agent.query import Answer
from envs import registry
from envs.gridworld import Gridworld
from parents.scripted import Judgement
from server.checkpoint import Saved, birth, unpack
from server.db import Database
from server.record import load_checkpoints
from server.settings import Settings
from server.tally import count
from server.worker import main
from tests.agent.lives import Judge

WORLD = "unsafe-exploration"
CONFIG: dict[str, Any] = {"stages": 3, "mature_every": 12, "max_open_preferences": 0, "time_limit": 12}
"""Clips of up to three steps, early ends, truncations and two maturations within some sixty answers."""
SEED = 11


class Inline:
    """The run without a database, under the scripted parent in tensors or under another. It ends hopeless
    episodes.
    """

    def __init__(self, seed: int = SEED, judge: Judge | None = None) -> None:
        self.world, self.config = world_and_config()
        self.judge = judge or Judgement(self.world, self.config.gamma).choose
        self.saved = birth(self.world, self.config, seed)
        self.query = parenting.no_query(self.world, self.config, self.saved.state)

    def tick(self) -> None:
        state, tally, config = self.saved
        if bool(state.stuck):
            state, config = parenting.apply(self.world, config, state, EndEpisode())
        answer = Answer(query=self.query, choice=self.judge(self.query))
        state, self.query = parenting.step(self.world, config, state, answer)
        self.saved = Saved(state, count(self.world, tally, answer, state), config)


def inline(ticks: int) -> Saved:
    """The state of the run after `ticks` ticks."""
    run = Inline()
    for _ in range(ticks):
        run.tick()
    return run.saved


def world_and_config() -> tuple[Gridworld, Config]:
    """What the run was started with."""
    config = Config(**{**PRESETS["lax"], "gamma": 0.9, **CONFIG})
    return registry.make(WORLD, time_limit=config.time_limit), config


def last(db: Database, run_id: int) -> Saved:
    """The newest checkpoint of a run."""
    world, config = world_and_config()
    newest = load_checkpoints(db, run_id)[0]
    assert newest.intact
    return unpack(world, config, newest.blob)


def same_bits(one: Saved, other: Saved) -> list[str]:
    """The names of the pieces of state that differ; the report is none."""
    wrong = [] if one.config == other.config else ["config"]
    for ours, theirs in ((one.state, other.state), (one.tally, other.tally)):
        expected = theirs.tensors()
        wrong += [
            name
            for name, part in ours.tensors().items()
            if not name.startswith("report.") and not equal(part, expected[name])
        ]
    return wrong


def equal(one: torch.Tensor, other: torch.Tensor) -> bool:
    """Bit for bit, shape and dtype included."""
    return one.dtype == other.dtype and one.shape == other.shape and bool(torch.equal(one, other))


@contextmanager
def worker(settings: Settings) -> Iterator[multiprocessing.process.BaseProcess]:
    """A worker in a process of its own, killed at the end if it still lives. Forked: torch need not load
    again.
    """
    process = multiprocessing.get_context("fork").Process(target=_work, args=(settings,))
    process.start()
    try:
        yield process
    finally:
        if process.is_alive():
            os.kill(process.pid or 0, signal.SIGKILL)
        process.join()


def _work(settings: Settings) -> None:
    os._exit(main(settings))
