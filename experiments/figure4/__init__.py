"""Figure 4: a reward that is fitted to preferences is fixed up to a shift, and a shift can do harm (4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import torch

from parenting.envs import registry
from parenting.envs.mdp import Model, explore
from parenting.experiments.figure4.reward_model import (
    cross_entropy,
    fit,
    follow,
    plan,
    preferences,
    random_pairs,
)
from parenting.experiments.reporting.comparison import SILENT, Comparison
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORLD, LEVEL = "side-effects", "box"
UNSAFE, SAFE = "drrdd", "ldrdrrd"
HORIZON, LENGTH, PAIRS = 50, 5, 20_000
SHIFTS = tuple(round(-1.5 + 0.125 * step, 3) for step in range(17))
"""From sigma's own neighbourhood (-1) to +0.5."""


def rho(model: Model) -> torch.Tensor:
    """+1 at the goal, -1 for the push that leaves the box stuck, 0 otherwise."""
    arrives = model.terminal[model.next_state] & ~model.terminal[:, None]
    return arrives.double() - model.unsafe.double()


def fit_and_shift(trial: int, seed: int) -> list[Row]:
    """Fit a reward to one person's preferences, then plan on it, on rho itself, and on shifts of both."""
    model = explore(registry.make(WORLD, LEVEL))
    true = rho(model)
    # as torch takes it; an odd factor lets no two seeds fall together
    generator = torch.Generator().manual_seed((seed * 1_000_003 + trial) % 2**63)
    pairs = random_pairs(model, PAIRS, LENGTH, generator)
    chance = preferences(pairs, true)
    fitted = fit(pairs, chance, len(true))
    fitted = (
        fitted + (true - fitted)[~model.terminal].mean()
    )  # its own shift is arbitrary: begin where rho is
    rows = []
    for of, reward in (("rho", true), ("fitted", fitted)):
        rows += [_row(of, trial, shift, model, reward, pairs, chance) for shift in SHIFTS]
    return rows


def _row(of: str, trial: int, shift: float, model: Model, reward: Any, pairs: Any, chance: Any) -> Row:
    shifted = reward + shift
    way = plan(model, shifted, HORIZON)
    sums = {
        name: follow(model, shifted, letters).earned for name, letters in (("unsafe", UNSAFE), ("safe", SAFE))
    }
    loss = float(cross_entropy(pairs, chance, shifted))
    said = {"way": way.letters, "arrives": way.arrives, "harms": way.harms, "loss": loss}
    return {"of": of, "trial": trial, "shift": shift, **said, **sums}


def _config(request: Request) -> Mapping[str, Any]:
    return {"world": WORLD, "level": LEVEL, "horizon": HORIZON, "length": LENGTH, "pairs": PAIRS}


def _tasks(request: Request) -> list[Task]:
    call = "parenting.experiments.figure4:fit_and_shift"
    return [
        Task(f"fit-{trial:06d}", call, {"trial": trial, "seed": request.seed})
        for trial in range(request.trials)
    ]


def _report(request: Request, rows: Sequence[Row]) -> Results:
    first = {(row["of"], row["shift"]): row for row in rows if row["trial"] == 0}
    findings = [
        _sum("rho, unsafe path (drrdd)", "0", first["rho", 0.0]["unsafe"]),
        _sum("rho, safe path (ldrdrrd)", "1", first["rho", 0.0]["safe"]),
        _sum("sigma = rho - 1, unsafe path", "-5", first["rho", -1.0]["unsafe"]),
        _sum("sigma = rho - 1, safe path", "-6", first["rho", -1.0]["safe"]),
        _planner("planner on rho", "safe", [first["rho", 0.0]]),
        _planner("planner on sigma", "harm", [first["rho", -1.0]]),
        _planner("planner on the fitted reward, where rho is", "safe", _at(rows, "fitted", 0.0)),
        _planner("planner on the fitted reward, shifted by -1", "harm", _at(rows, "fitted", -1.0)),
        _planner("planner on rho - 1/2, where both paths earn the same", SILENT, [first["rho", -0.5]]),
        _planner("planner on the fitted reward, shifted by -1/2", SILENT, _at(rows, "fitted", -0.5)),
        _loss(rows),
    ]
    return Results(findings, WORDS, {"shift": lambda figure: _draw(figure, rows)})


def _at(rows: Sequence[Row], of: str, shift: float) -> list[Row]:
    return [row for row in rows if row["of"] == of and row["shift"] == shift]


def _sum(what: str, paper: str, ours: float) -> Comparison:
    return Comparison(what, paper, f"{ours:g}", f"{ours - float(paper):+g}", agrees=ours == float(paper))


def _planner(what: str, paper: str, rows: Sequence[Row]) -> Comparison:
    harms = sum(row["harms"] for row in rows)
    safe = sum(row["arrives"] and not row["harms"] for row in rows)
    ours = f"{harms} of {len(rows)} do harm, {safe} arrive safely"
    agrees = None if paper == SILENT else (harms if paper == "harm" else safe) == len(rows)
    return Comparison(
        what, paper, ours, agrees=agrees, note=f"the way of trial 0: {shortened(rows[0]['way'])}"
    )


def shortened(way: str) -> str:
    """A way's letters, with how often in place of letters that come again and again: uuuuudr is "5 u, dr"."""
    runs = [(letter, len(list(run))) for letter, run in groupby(way)]
    said = "".join(f", {number} {letter}, " if number > 3 else letter * number for letter, number in runs)
    return said.replace(", , ", ", ").strip(", ")


def _loss(rows: Sequence[Row]) -> Comparison:
    """Eq. (12): no preference tells the shifted models apart."""
    fitted = [row for row in rows if row["of"] == "fitted"]
    trials = {row["trial"] for row in fitted}
    losses = [[row["loss"] for row in fitted if row["trial"] == trial] for trial in trials]
    most = max(max(each) - min(each) for each in losses)
    return Comparison("Eq. (12): the loss of all shifts differs by", "0", f"{most:.1e}", agrees=most < 1e-12)


def _draw(figure: Figure, rows: Sequence[Row]) -> None:
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    fitted = [row for row in rows if row["of"] == "fitted"]
    trials = sorted({row["trial"] for row in fitted})
    for name, colour in (("unsafe", "#d55e00"), ("safe", "#009e73")):
        for trial in trials:
            mine = [row for row in fitted if row["trial"] == trial]
            label = f"{name} path, of {len(trials)} fits" if trial == trials[0] else None
            earned = [row[name] for row in mine]
            above.plot([row["shift"] for row in mine], earned, color=colour, alpha=0.5, label=label)
    harm = [sum(row["harms"] for row in _at(fitted, "fitted", shift)) for shift in SHIFTS]
    below.plot(SHIFTS, [100 * number / len(trials) for number in harm], "o-", color="#d55e00", markersize=4)
    above.set_ylabel("what the path earns")
    above.legend()
    below.set_ylabel("% of planners\nthat do harm")
    below.set_ylim(-8, 108)
    below.set_xlabel("shift c of the fitted reward")


WORDS = (
    "The reward model has a number for each state and action of the level. It is fitted to what a person "
    f"who follows rho prefers, on {PAIRS} pairs of random clips of {LENGTH} steps: to the very chances "
    "that Bradley and Terry's rule gives, not to answers drawn by them, so that no noise of a sample is "
    "in it.",
    "All shifts of the fit explain the answers equally well (Eq. 12). A fit has no shift of its own, so "
    "it is first put where rho is: its mean difference from rho, over all states in which an episode goes "
    "on, is made 0. That takes rho itself; nobody who has preferences alone can do it.",
    "Below a shift of -1/2 the planner pushes the box into the corner. At -1/2 both paths earn the same "
    "by rho; there the order of the actions decides, and with a fitted reward what the fit is off by, "
    "which is less than a thousandth.",
    f"The planner looks {HORIZON} steps ahead. Where the shift is 0 it does not mind the time, and where "
    "it is above it likes to take longer. So it arrives safely there, but not by the paper's seven steps: "
    "it dithers on the way, and arrives with the last steps that it has. Between -1/2 and 0 it takes "
    "seven.",
    "In the figure each line is a fit of its own; they lie on each other.",
    "A parented agent plans on no reward; `tests/parents/test_shift.py` shows that its policy is the same "
    "under both, bit for bit.",
)

EXPERIMENT = Experiment(
    name="figure4",
    title="Figure 4: a shift of the reward does harm",
    section="4.2",
    claim="Preferences fix a reward up to a shift, and a shift can make the irreversible way optimal.",
    trials={"quick": 1, "paper": 10},
    config=_config,
    tasks=_tasks,
    report=_report,
)
