"""The history of trials in training: numbers of each after some ticks, few enough to be kept."""

from __future__ import annotations

import math
import time
from typing import Any

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.state import AgentState
from parenting.evaluation.argmax import Evaluation
from parenting.experiments.training.counts import Counts

ROWS = 200
"""Rows of a trial at most, besides its last. Where they are full, every second one is left out."""
LEARNT = ("loss", "entropy_global", "entropy_local")
WHOLE = ("tick", "deaths", "guidance", "preference", "size", "rows", "maturity", "optimal")
COLUMNS = (*WHOLE, "return", "seconds", *LEARNT)
"""The columns of a row; "seconds" are those since the batch began."""

Table = Float64[Tensor, "N R K"]


class History:
    """Rows of each trial of a batch: after ticks that are evenly spread over its life, and after its last."""

    def __init__(self, trials: int, evaluation: Evaluation) -> None:
        """Begin with no rows; the clock starts now."""
        self.evaluation, self.began = evaluation, time.monotonic()
        self.table = torch.full((trials, ROWS + 1, len(COLUMNS)), math.nan, dtype=torch.float64)
        self.learnt = torch.full((trials, len(LEARNT)), math.nan, dtype=torch.float64)
        self.used, self.every = 0, 1

    def note(self, tick: int, trial: Int64[Tensor, "n"], state: AgentState, counts: Counts) -> None:
        """Keep a row after this tick, if one is due, of the trials that are not done."""
        self._learn(trial, state)
        if (tick - 1) % self.every:
            return
        if self.used == ROWS:
            self._thin()
            if (tick - 1) % self.every:
                return
        left = ~counts.done.cpu()
        self.table[trial[left], self.used] = self._rows(trial, state, counts)[left]
        self.used += 1

    def end(
        self, which: Bool[Tensor, "n"], trial: Int64[Tensor, "n"], state: AgentState, counts: Counts
    ) -> None:
        """Keep the last row of some trials."""
        which = which.cpu()
        if bool(which.any()):
            self.table[trial[which], ROWS] = self._rows(trial, state, counts)[which]

    def _thin(self) -> None:
        half = self.table[:, :ROWS:2].clone()
        self.table[:, :ROWS] = math.nan
        self.table[:, : half.shape[1]] = half
        self.used, self.every = half.shape[1], 2 * self.every

    def _learn(self, trial: Int64[Tensor, "n"], state: AgentState) -> None:
        trained = state.info.trained.cpu()
        if bool(trained.any()):
            now = torch.stack([getattr(state.info, name).double().cpu() for name in LEARNT], 1)
            self.learnt[trial[trained]] = now[trained]

    def _rows(self, trial: Int64[Tensor, "n"], state: AgentState, counts: Counts) -> Float64[Tensor, "n K"]:
        """Return the numbers of trials now. The return is left out where it takes episodes to measure it."""
        live = state.learner.params
        nothing = torch.full((len(trial),), math.nan)
        exact = not self.evaluation.refresh_seconds
        found = {
            "tick": counts.ticks,
            "deaths": counts.deaths,
            "guidance": counts.guidance,
            "preference": counts.preference,
            "size": state.x.size,
            "rows": state.x.rows,
            "maturity": state.maturity,
            "optimal": self.evaluation.optimal(live),
            "return": self.evaluation.returns(live) if exact else nothing,
            "seconds": torch.full((len(trial),), time.monotonic() - self.began),
        }
        columns = [found[name].double().cpu() for name in COLUMNS[: -len(LEARNT)]]
        return torch.cat((torch.stack(columns, 1), self.learnt[trial]), 1)


def no_history(trials: int) -> Table:
    """Return the table of a batch whose history is not kept."""
    return torch.zeros(trials, 0, len(COLUMNS), dtype=torch.float64)


def metrics(table: Float64[Tensor, "R K"]) -> dict[int, dict[str, Any]]:
    """Return the rows of one trial by tick, as the server stores metrics; what is absent is None."""
    found = {}
    for row in table.tolist():
        values = dict(zip(COLUMNS, row, strict=True))
        if not math.isnan(values["tick"]):
            read = {name: _value(name, value) for name, value in values.items() if name != "tick"}
            found[int(values["tick"])] = read
    return found


def _value(name: str, value: float) -> float | int | None:
    if math.isnan(value):
        return None
    return int(value) if name in WHOLE else value
