"""The agent's whole state rebuilt from the record alone, by plain SQL and the agent's own code (A5, C1, C2).

It imports nothing of `parenting.server`: it reads the stored answers and events with their ticks, raises the
agent from tick 0, holds every query to its stored row, and compares all tensors with the last checkpoint's.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Sequence
from typing import Any

import torch
from pydantic import TypeAdapter

from parenting.agent import amendment, parenting
from parenting.agent import query as queries
from parenting.agent.amendment import Applied, Correction, TickEvent
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.init import world_of
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState, current_names
from parenting.drawing.query_tensors import read_clips
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from tests.faults.auditor import Store, checkpoint_bytes

_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)
CHOICES = {name: Choice[name.upper()] for name in ("left", "right", "either", "neither", "skip")}


def read_json(value: Any) -> Any:
    """A JSON column: SQLite gives its text, PostgreSQL its content."""
    return json.loads(value) if isinstance(value, str) else value


def whole(clips: Any) -> Any:
    """Clips with the boards in each frame; in the short forms they stand once, all but one by differences."""
    if isinstance(clips, list):
        left, right, *grids = clips
        return {"left": from_list(left, full(grids)), "right": from_list(right, full(grids))}
    if "grids" not in clips:
        return clips
    boards = full(clips["grids"])
    return {
        side: clip
        | {
            "frames": [
                {"ground": boards[ground], "observed": boards[observed], "agent": agent, "box": box}
                for ground, observed, agent, box in clip["frames"]
            ]
        }
        for side, clip in clips.items()
        if side != "grids"
    }


def full(grids: list[Any]) -> list[list[str]]:
    """The rows of all boards, of which only the first is stored in full."""
    boards = []
    for board in grids:
        cells = list(grids[0])
        changes = [] if isinstance(board, str) else board
        for place, glyph in zip(changes[::2], changes[1::2], strict=True):
            cells[place] = glyph
        boards.append("".join(cells).split("\n"))
    return boards


def from_list(side: list[Any], boards: list[list[str]]) -> dict[str, Any]:
    """A clip of which letters, numbers and perhaps a chance are stored."""
    words = {word[0]: word for word in ("up", "down", "left", "right")}
    actions = [words[letter] for letter in side[0]]
    many = len(side[1]) // (len(actions) + 1)
    parts = [side[1][first : first + many] for first in range(0, len(side[1]), many)]
    frames = [
        {"ground": boards[one[0]], "observed": boards[one[1]], "agent": one[2:4], "box": one[4:] or None}
        for one in parts
    ]
    chance = {"chance": side[2]} if len(side) > 2 else {}
    return {"actions": actions, "length": len(actions), "frames": frames, **chance}


class Recorded:
    """A parent that gives stored answers back at their ticks and holds what is asked to the stored rows."""

    def __init__(self, store: Store, run: int, world: Gridworld, stages: int) -> None:
        self.world, self.nothing = world, queries.empty(1, stages, world.height, world.width)
        self.asked = {
            row["tick"]: row for row in store.rows(f"SELECT * FROM query WHERE run_id = {run} ORDER BY tick")
        }
        ticks = {row["id"]: row["tick"] for row in self.asked.values()}
        answers = store.rows(f"SELECT * FROM answer WHERE run_id = {run} AND applied_tick IS NOT NULL")
        self.heard = {row["applied_tick"]: (ticks[row["query_id"]], row["choice"]) for row in answers}
        self.correction: Applied | None = None  # of this tick
        self.operator = store.rows(
            f"SELECT * FROM event WHERE run_id = {run} AND applied_tick IS NOT NULL ORDER BY id"
        )
        self.kept: dict[int, Query] = {}
        self.tick, self.found = 0, list[str]()

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        self.tick = int(state.keys.tick[0]) + 1
        rows = [row for row in self.operator if row["applied_tick"] == self.tick]
        events = [_EVENTS.validate_python({"kind": row["kind"], **read_json(row["payload"])}) for row in rows]
        correction = self._correction()
        self.correction = None if correction is None else amendment.take(state, events, correction)
        return events if self.correction is None else [*events, self.correction.event]

    def _correction(self) -> Correction | None:
        """The correction of this tick: an answer to a query of which another answer was heard before."""
        asked, choice = self.heard.get(self.tick, (-1, ""))
        last = {
            known: (tick, said)
            for tick, (known, said) in sorted(self.heard.items())
            if tick < self.tick and known in self.kept
        }
        if asked not in last:
            return None
        standing = {**last, asked: (self.tick, choice)}
        return Correction(
            self._answer(asked, choice),
            self._answer(asked, last[asked][1]),
            [
                self._answer(known, said)
                for known, (tick, said) in sorted(standing.items(), key=lambda one: one[1])
            ],
            asked,
        )

    def take(self, state: AgentState) -> Answer:
        if self.correction is not None and self.correction.heard is not None:
            return self.correction.heard
        if self.correction is not None or self.tick not in self.heard:
            return queries.silence(self.nothing)
        asked, choice = self.heard[self.tick]
        if asked not in self.kept:
            self.found.append(
                f"C2 at tick {self.tick} an answer to tick {asked} is heard, where nothing was asked"
            )
            return queries.silence(self.nothing)
        return self._answer(asked, choice)

    def _answer(self, asked: int, choice: str) -> Answer:
        query = self.kept[asked]
        return Answer(query=query, choice=torch.full_like(query.kind, int(CHOICES[choice])))

    def post(self, query: Query) -> None:
        row = self.asked.get(self.tick)
        if int(query.kind[0]) == QueryKind.NONE:
            if row is not None:
                self.found.append(f"C2 a query is stored at tick {self.tick}, where nothing is asked")
            return
        self.kept[self.tick] = query.clone()
        kind = QueryKind(int(query.kind[0])).name.lower()
        asked = [kind, int(query.maturity[0]), read_json(json.dumps(read_clips(query, self.world.legend)))]
        if row is None or asked != [row["kind"], row["maturity"], whole(read_json(row["clips"]))]:
            self.found.append(f"C3 the query of tick {self.tick} is not the stored one")


def rebuild(store: Store, run: int) -> list[str]:
    """Each way in which a run's last intact checkpoint differs from what its record gives, weights fresh."""
    (row,) = store.rows(f"SELECT * FROM run WHERE id = {run}")
    config = Config.model_validate(read_json(row["config"]))
    world = world_of(row["world"], row["level_text"], config)
    saved = _checkpoint(store, run)
    state, parent = (
        parenting.init(world, config, keys(row["seed"], 1), None),
        Recorded(store, run, world, config.max_clip_length),
    )
    last = int(saved["keys.tick"][0])
    for _ in range(last):
        state, _, _, config, _ = parenting.tick(world, config, state, parent)
    late = [tick for tick in parent.asked if tick <= last and tick not in parent.kept]
    found = parent.found + [f"C2 the query stored at tick {tick} was not asked" for tick in late]
    return found + [f"A5 {name} differs from the record" for name in _differing(state, saved)]


def entries_of_x(store: Store, run: int) -> tuple[int, int]:
    """The entries of X in the last checkpoint, and the answers up to its tick that may have entered it."""
    saved = _checkpoint(store, run)
    heard = store.rows(
        f"SELECT query_id, choice FROM answer WHERE run_id = {run} "
        f"AND applied_tick <= {int(saved['keys.tick'][0])} ORDER BY applied_tick"
    )
    standing = {row["query_id"]: row["choice"] for row in heard}
    return int(saved["x.size"][0]), sum(choice not in ("neither", "skip") for choice in standing.values())


def _differing(state: AgentState, saved: dict[str, torch.Tensor]) -> list[str]:
    parts = {name: part for name, part in state.tensors().items() if not name.startswith("info.")}
    assert parts.keys() == saved.keys()
    return [name for name, part in parts.items() if not torch.equal(part, saved[name])]


def _checkpoint(store: Store, run: int) -> dict[str, torch.Tensor]:
    rows = store.rows(f"SELECT * FROM checkpoint WHERE run_id = {run} ORDER BY id DESC")
    blobs = [(checkpoint_bytes(store, row), row["sha256"]) for row in rows]
    intact = [blob for blob, sha256 in blobs if hashlib.sha256(blob).hexdigest() == sha256]
    whole = torch.load(io.BytesIO(intact[0]), weights_only=True)
    named: dict[str, torch.Tensor] = dict(current_names(whole["state"]))
    return named
