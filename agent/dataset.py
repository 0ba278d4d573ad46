"""X, the parent's answers as the agent trains on them (Sec. 2.3).

The record of all entries is the table of answered queries. This is the view of it that training needs:
distinct first
states, and distinct (state, pair of actions) rows with their summed `mu`, because Eq. (2) sees nothing else
of an entry.
So a gradient step costs what the distinct states demand, however often the same question was answered.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64, UInt8
from torch import Tensor

from parenting.envs.fingerprint import fingerprint
from parenting.envs.struct import Struct

FIRST, SECOND, EITHER, NEITHER = range(4)
"""The answers to guidance about a pair of moves, the smaller move first: the places of `Dataset.guided`."""


class Dataset(Struct):
    """Distinct states, and rows in the order of their first entry.

    Elements beyond `states` and `rows` are zero.
    """

    s0: UInt8[Tensor, "N S H W"]  # the first states, as observed
    local_state: UInt8[Tensor, "N S 4"]  # their local states l(s)
    digest: Int64[Tensor, "N S"]
    guided: Int64[Tensor, "N S 6 4"]  # guidance by state, pair of moves and answer (ours; see agent.memory)
    states: Int64[Tensor, "N"]
    state_index: Int64[Tensor, "N R"]  # the row's state
    a0: Int64[Tensor, "N R 2"]  # the first actions of both clips
    mu: Float64[Tensor, "N R 2"]  # Eq. (1), summed over the row's entries
    rows: Int64[Tensor, "N"]
    size: Int64[Tensor, "N"]  # entries of X, those that train no more included


class Entry(Struct):
    """The part of one answered query that enters Eq. (2)."""

    s0: UInt8[Tensor, "N H W"]
    local_state: UInt8[Tensor, "N 4"]
    a0: Int64[Tensor, "N 2"]
    mu: Float64[Tensor, "N 2"]


def empty(trials: int, height: int, width: int, device: str | torch.device = "cpu") -> Dataset:
    """X before the first answer."""

    def zeros(*shape: int, dtype: torch.dtype = torch.int64) -> Tensor:
        return torch.zeros(trials, *shape, dtype=dtype, device=device)

    return Dataset(
        s0=zeros(8, height, width, dtype=torch.uint8),
        local_state=zeros(8, 4, dtype=torch.uint8),
        digest=zeros(8),
        guided=zeros(8, 6, 4),
        states=zeros(),
        state_index=zeros(8),
        a0=zeros(8, 2),
        mu=zeros(8, 2, dtype=torch.float64),
        rows=zeros(),
        size=zeros(),
    )


def add(x: Dataset, entry: Entry, stored: Bool[Tensor, "N"], trained: Bool[Tensor, "N"]) -> Dataset:
    """X with one more entry where `stored` holds; without `trained` as well, it is only counted."""
    x = x.replace(size=x.size + stored)
    trial = (stored & trained).nonzero().squeeze(1)
    if not len(trial):
        return x
    entry = entry.pick(trial)
    x, state = place_state(x, entry, trial)
    return _place_row(x, entry, trial, state)


def imply(
    x: Dataset, entry: Entry, moves: tuple[int, int], trial: Int64[Tensor, "n"], state: Int64[Tensor, "n"]
) -> Dataset:
    """X with a row that follows from others: the first move is better. No row that is there is changed."""
    a0 = torch.tensor(moves, device=trial.device)
    here = (x.state_index[trial] == state[:, None]) & _taken(x, trial)
    new = ~(here & (x.a0[trial].sort(-1).values == a0.sort().values).all(-1)).any(1)
    if not bool(new.any()):
        return x
    row = entry.replace(
        a0=a0.expand_as(entry.a0), mu=torch.tensor([1.0, 0.0]).to(entry.mu).expand_as(entry.mu)
    )
    return _place_row(_room(x), row.pick(new), trial[new], state[new])


def _taken(x: Dataset, trial: Int64[Tensor, "n"]) -> Bool[Tensor, "n R"]:
    return torch.arange(x.state_index.shape[1], device=trial.device) < x.rows[trial, None]


def clear(x: Dataset, mask: Bool[Tensor, "N"]) -> Dataset:
    """Nothing left to train on where `mask` holds (`own_stage_only`); the count of entries stays."""
    height, width = x.s0.shape[2:]
    fresh = empty(len(mask), height, width, x.s0.device)
    widened = _pad(fresh, x.s0.shape[1], x.state_index.shape[1])
    return widened.where(mask, x).replace(size=x.size)


def blank(x: Dataset) -> Dataset:
    """X without any entry, in every trial, with as much room as before."""
    return clear(x, torch.ones_like(x.states, dtype=torch.bool)).replace(size=torch.zeros_like(x.size))


def _room(x: Dataset) -> Dataset:
    """Twice the room where one more state or row would not fit. What a trial holds does not depend on it."""
    states, rows = x.s0.shape[1], x.state_index.shape[1]
    full = int(x.states.max()) == states, int(x.rows.max()) == rows
    return _pad(x, states * (2 if full[0] else 1), rows * (2 if full[1] else 1)) if any(full) else x


def _pad(x: Dataset, states: int, rows: int) -> Dataset:
    room = {
        "s0": states,
        "local_state": states,
        "digest": states,
        "guided": states,
        "state_index": rows,
        "a0": rows,
        "mu": rows,
    }

    def widen(name: str, tensor: Tensor, _axis: int | None) -> Tensor:
        if name not in room or tensor.shape[1] == room[name]:
            return tensor
        wide = tensor.new_zeros(tensor.shape[0], room[name], *tensor.shape[2:])
        wide[:, : tensor.shape[1]] = tensor
        return wide

    return x.map(widen)


def place_state(x: Dataset, entry: Entry, trial: Int64[Tensor, "n"]) -> tuple[Dataset, Int64[Tensor, "n"]]:
    """X with room for one more entry and these states among its own; and their places. In place."""
    x = _room(x)
    digest = fingerprint(entry.s0.flatten(1))
    taken = torch.arange(x.digest.shape[1], device=trial.device) < x.states[trial, None]
    same = taken & (x.digest[trial] == digest[:, None])
    known = same.any(1)
    state = torch.where(known, same.int().argmax(1), x.states[trial])
    x.s0[trial, state], x.local_state[trial, state], x.digest[trial, state] = (
        entry.s0,
        entry.local_state,
        digest,
    )
    x.states[trial] += (~known).long()
    return x, state


def _place_row(x: Dataset, entry: Entry, trial: Int64[Tensor, "n"], state: Int64[Tensor, "n"]) -> Dataset:
    here = _taken(x, trial) & (x.state_index[trial] == state[:, None])
    alike = here & (x.a0[trial] == entry.a0[:, None]).all(-1)
    swapped = here & (x.a0[trial] == entry.a0.flip(1)[:, None]).all(-1)
    known = alike.any(1) | swapped.any(1)
    row = torch.where(known, (alike | swapped).int().argmax(1), x.rows[trial])
    turn = swapped.any(1)[:, None]
    x.state_index[trial, row] = state
    x.a0[trial, row] = torch.where(turn, entry.a0.flip(1), entry.a0)
    x.mu[trial, row] += torch.where(turn, entry.mu.flip(1), entry.mu)
    x.rows[trial] += (~known).long()
    return x
