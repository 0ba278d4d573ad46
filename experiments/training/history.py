"""The history of trials in training: numbers of each after some ticks, few enough to be kept."""

from __future__ import annotations

import math
import time
from typing import Any

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.query import Answer, Choice
from parenting.agent.state import AgentState
from parenting.evaluation.argmax import Evaluation
from parenting.experiments.training.counts import Counts

ROWS = 200
"""Rows of a trial at most, besides its last. Where they are full, every second one is left out."""
LEARNT = ("loss", "entropy_global", "entropy_local")
CHOICES = {
    "left": Choice.LEFT,
    "right": Choice.RIGHT,
    "either": Choice.EITHER,
    "neither": Choice.NEITHER,
    "skips": Choice.SKIP,
}
WHOLE = ("tick", "deaths", "guidance", "preference", *CHOICES, "size", "rows", "maturity", "optimal")
COLUMNS = (*WHOLE, "return", "seconds", *LEARNT)
"""The columns of a row; "seconds" are those since the batch began."""
MEASURING = 0.05
"""The share of the time of a training that goes at most into returns that take episodes to measure."""

Table = Float64[Tensor, "N R K"]


class History:
    """Rows of each trial of a batch: after ticks that are evenly spread over its life, and after its last."""

    def __init__(self, trials: int, evaluation: Evaluation) -> None:
        """Begin with no rows; the clock starts now."""
        self.evaluation, self.began = evaluation, time.monotonic()
        self.table = torch.full((trials, ROWS + 1, len(COLUMNS)), math.nan, dtype=torch.float64)
        self.learnt = torch.full((trials, len(LEARNT)), math.nan, dtype=torch.float64)
        self.chosen = torch.zeros(trials, len(CHOICES), dtype=torch.float64)
        self.measured = -math.inf  # from when on a return may be measured
        self.used, self.every = 0, 1

    def hear(self, trial: Int64[Tensor, "n"], answer: Answer) -> None:
        """Count the answers of a tick by choice."""
        given = torch.stack([answer.choice == choice for choice in CHOICES.values()], 1)
        self.chosen[trial] += given.cpu()

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
        """Return the numbers of trials now."""
        live = state.learner.params
        found = {
            "tick": counts.ticks,
            "deaths": counts.deaths,
            "guidance": counts.guidance,
            "preference": counts.preference,
            "size": state.x.size,
            "rows": state.x.rows,
            "maturity": state.maturity,
            "optimal": self.evaluation.optimal(live),
            "return": self._returns(live),
            **dict(zip(CHOICES, self.chosen[trial].T, strict=True)),
            "seconds": torch.full((len(trial),), time.monotonic() - self.began),
        }
        columns = [found[name].double().cpu() for name in COLUMNS[: -len(LEARNT)]]
        return torch.cat((torch.stack(columns, 1), self.learnt[trial]), 1)

    def _returns(self, live: Float[Tensor, "n P"]) -> Float64[Tensor, "n"]:
        """Return what the policies earn. Where it takes episodes to measure it, most rows have none."""
        began = time.monotonic()
        if began < self.measured:
            return torch.full((len(live),), math.nan, dtype=torch.float64)
        found = self.evaluation.returns(live)
        ended = time.monotonic()
        if rest := self.evaluation.refresh_seconds:
            self.measured = ended + max(rest, (ended - began) / MEASURING)
        return found


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
