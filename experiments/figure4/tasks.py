"""Tasks of Figure 4: fit a reward to preferences, then plan on it, on rho, and on shifts of both (4.2)."""

from __future__ import annotations

from typing import Any

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
from parenting.experiments.figure4.settings import HORIZON, LENGTH, LEVEL, PAIRS, SAFE, SHIFTS, UNSAFE, WORLD
from parenting.experiments.runner.store import Row


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
