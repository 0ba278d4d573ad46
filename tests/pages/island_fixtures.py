"""Clips, questions and a life on the island, made by hand: what the pages are tested with."""

from __future__ import annotations

from typing import Any

from parenting.drawing.clip import Clip, Frame
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, claim
from parenting.server.tables import Run

MOVES = {"up": (-1, 0), "down": (1, 0), "left": (0, -1), "right": (0, 1)}
ISLAND = ("WW######", "WW     W", "WW     W", "W      W", "W  G  WW", "W#######")
START = (1, 4)


def clip(*actions: str, start: tuple[int, int] = START, rows: tuple[str, ...] = ISLAND) -> Clip:
    """The agent's moves from `start`; water and goal end it early."""
    at = start
    done: list[str] = []
    frames = [_frame(rows, at)]
    for action in actions:
        row, column = (a + b for a, b in zip(at, MOVES[action], strict=True))
        inside = 0 <= row < len(rows) and 0 <= column < len(rows[0])
        at = (row, column) if inside and rows[row][column] != "#" else at
        done.append(action)
        frames.append(_frame(rows, at))
        if rows[at[0]][at[1]] in "WG":
            break
    return {"actions": done, "length": len(done), "frames": frames}


def _frame(rows: tuple[str, ...], at: tuple[int, int]) -> Frame:
    observed = list(rows)
    if rows[at[0]][at[1]] != "W":
        observed[at[0]] = rows[at[0]][: at[1]] + "A" + rows[at[0]][at[1] + 1 :]
    return {"ground": list(rows), "observed": observed, "agent": list(at), "box": None}


def guidance(left: str, right: str, start: tuple[int, int] = START) -> dict[str, Any]:
    """Two moves from one cell."""
    return {"left": clip(left, start=start), "right": clip(right, start=start)}


def preference(left: str, right: str, start: tuple[int, int] = START) -> dict[str, Any]:
    """Two clips from one cell, written as actions with blanks between."""
    return {"left": clip(*left.split(), start=start), "right": clip(*right.split(), start=start)}


def start_run(db: Database, **fields: Any) -> tuple[Run, Claim]:
    """A run that a worker raises just now."""
    run = start(db, NewRun(**{"world": "unsafe-exploration", **fields}))
    mine = next(claim for claim in claim(db, "worker") if claim.run_id == run.id)
    report_progress(db, mine, tick=0)
    return run, mine


def measure(db: Database, mine: Claim, ticks: int, begin: int = 1, maturity: int = 1) -> None:
    """Metrics as an agent that learns has them, up to a tick."""
    rows = {}
    for tick in range(begin, ticks + 1):
        done = tick / ticks
        rows[tick] = {
            "deaths": 2 * (tick > 20) + (tick > 45),
            "guidance": int(30 * done),
            "preference": int(6 * done),
            "left": int(14 * done),
            "right": int(12 * done),
            "either": int(6 * done),
            "neither": int(4 * done),
            "loss": None if tick < 3 else 4.2 * (1 - done) ** 2 + 0.02,
            "entropy_global": 1.386 * (1 - 0.6 * done),
            "entropy_local": 1.386 * (1 - 0.5 * done),
            "return": 45.0 if done > 0.8 else -100.0 + 40 * (done > 0.5),
            "optimal_return": 45.0,
            "optimal": int(done > 0.8),
            "rows": int(20 * done),
            "size": int(32 * done),
            "maturity": maturity,
            "episodes": int(9 * done),
        }
    write_metrics(db, mine, rows)
    report_progress(db, mine, tick=ticks)


def ask(db: Database, mine: Claim, tick: int, kind: str, clips: dict[str, Any]) -> int:
    """Post a question and return its id."""
    return post_query(db, mine, tick, kind, 1, clips)
