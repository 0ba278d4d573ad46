"""The states whose numbers are stored: all that can be reached if they are few, else those that are met."""

from __future__ import annotations

from typing import Any

import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from parenting.agent.familiarity import local_state_index
from parenting.agent.init import network_of
from parenting.drawing.query_tensors import glyph_rows
from parenting.drawing.rests import parts_of
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.mdp import Model
from parenting.envs.tables.rules import TableRules
from parenting.evaluation.cells import cells_of
from parenting.server.board.columns import SHARE
from parenting.server.board.store import Stored

MOST_STATES = 5_000
"""States whose numbers are stored, at the most."""
MOST_GLYPHS = 1_000_000
"""Cells of all boards of the rests together, at the most."""
GLYPHS_AT_ONCE = 8_000
"""Cells of the boards of a batch. It takes some milliseconds, and twenty where boards are largest."""

Key = tuple[bytes, int, int, int, int]
"""A board, the agent's cell and the box's."""


class KnownStates:
    """The states of one run that are stored, in the order in which they were added."""

    def __init__(self, world: Gridworld, model: Model | None, stored: Stored | None = None) -> None:
        """Begin with all states of a model that are few enough, or with the cells of an episode's beginning.

        Args:
            world: The run's world.
            model: All states in reach; None where they cannot be listed.
            stored: What an earlier worker stored: these states come first.
        """
        self.world = world
        living = None if model is None else (~model.terminal).nonzero().squeeze(1)
        self.complete = living is not None and len(living) <= MOST_STATES
        self.places: dict[Key, int] = {}
        self.rests: list[dict[str, Any]] = []
        self.cells: list[list[int]] = []
        self._rest_of: dict[tuple[bytes, int, int], int] = {}
        self._seen: list[UInt8[Tensor, "S H W"]] = []
        self._local: list[UInt8[Tensor, "S 4"]] = []
        self._at_once = max(1, GLYPHS_AT_ONCE // (world.height * world.width))
        self._most_rests = max(1, MOST_GLYPHS // (world.height * world.width))
        start = world.beginnings().pick(torch.tensor([0]))
        self._first = glyph_rows(world.legend, start.board[0])
        if stored is not None:
            self._add(self._restored(start, stored))
        if self.complete and model is not None and living is not None:
            self._add(model.states.pick(living))
        else:
            cells = torch.tensor(cells_of(world, start).cells)
            self._add(start.pick(torch.zeros(len(cells), dtype=torch.int64)).replace(agent=cells))

    def place(self, state: WorldState) -> int | None:
        """Return the number of a state, adding it if it is new; None where no more are kept."""
        key = _key(state, 0)
        found = self.places.get(key)
        if found is None and not self.complete and not bool(state.terminated[0]):
            self._add(state)
            found = self.places.get(key)
        return found

    def find(self, board: Tensor, agent: Tensor, box: Tensor) -> int | None:
        """Return the number of the state of a question's first frame."""
        key = (board.to(torch.uint8).numpy().tobytes(), *agent.tolist(), *box.tolist())
        return self.places.get(key)

    def stored(self) -> Stored:
        """Return cells and rests as they are stored."""
        return {"rests": self.rests, "cells": self.cells}

    def familiarity(self, counts: Tensor) -> Tensor:
        """Return f of the local state of each state (Sec. 2.1)."""
        local = torch.cat(self._local)
        return counts[local_state_index(local, len(self.world.legend))]

    def policy(self, parameters: Float[Tensor, "1 P"], begin: int, end: int) -> bytes:
        """Return pi(a|s) in 255ths for a batch of states from `begin` on, none of them from `end` on.

        Batches begin at the same states whenever this is called on from 0, so that the bits are the same.
        """
        if len(self._seen) > 1:
            self._seen, self._local = [torch.cat(self._seen)], [torch.cat(self._local)]
        some = slice(begin, min(end, begin + self._at_once))
        seen, local = self._seen[0][some].unsqueeze(0), self._local[0][some].unsqueeze(0)
        network = network_of(self.world)
        with torch.no_grad():
            heads = network.heads(network.unpack(parameters), seen, local)
        chances = heads.logits[0].double().softmax(-1)
        return (chances * SHARE).round().to(torch.uint8).numpy().tobytes()

    def _restored(self, start: WorldState, stored: Stored) -> WorldState:
        legend, rests = self.world.legend, stored["rests"]
        codes = [[[legend.index(glyph) for glyph in row] for row in rest["ground"]] for rest in rests]
        boxes = torch.tensor([rest["box"] or [-1, -1] for rest in rests])
        which = torch.tensor([rest for _, _, rest in stored["cells"]])
        return start.pick(torch.zeros_like(which)).replace(
            board=torch.tensor(codes, dtype=torch.uint8)[which],
            agent=torch.tensor([[row, column] for row, column, _ in stored["cells"]]),
            box=boxes[which],
        )

    def _add(self, states: WorldState) -> None:
        kept = []
        for at in range(len(states.step_count)):
            key = _key(states, at)
            rest = self._rest(states, at)
            if rest is None or key in self.places or len(self.cells) >= MOST_STATES:
                continue
            self.places[key] = len(self.cells)
            self.cells.append([key[1], key[2], rest])
            kept.append(at)
        if kept:
            some = states.pick(torch.tensor(kept))
            seen = self.world.observe(some.board, some.agent, some.box)
            self._seen.append(seen)
            self._local.append(local_state(seen, some.agent))

    def _rest(self, states: WorldState, at: int) -> int | None:
        board, box = states.board[at], states.box[at].tolist()
        key = (board.numpy().tobytes(), *box)
        if key not in self._rest_of and len(self.rests) < self._most_rests:
            ground, there = glyph_rows(self.world.legend, board), None if box[0] < 0 else (box[0], box[1])
            self._rest_of[key] = len(self.rests)
            parts = self._layer(ground) or parts_of(ground, there, self._first, self.world.spec.legend)
            self.rests.append(
                {"ground": ground, "box": None if there is None else list(there), "parts": parts}
            )
        return self._rest_of.get(key)

    def _layer(self, ground: list[str]) -> dict[str, str]:
        """Say which layer of a table a board is, by the name that the table gives it; else nothing."""
        if not isinstance(self.world, TableRules) or len(self.world.table.layers) == 1:
            return {}
        rows = tuple(ground)
        return {"state": next(one.name for one in self.world.table.layers if one.rows == rows)}


def _key(states: WorldState, at: int) -> Key:
    (row, column), (box_row, box_column) = states.agent[at].tolist(), states.box[at].tolist()
    return states.board[at].numpy().tobytes(), row, column, box_row, box_column
