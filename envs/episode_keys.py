"""The keys of one trial through an episode: each stream is drawn for many ticks in one call.

The draws are those of `envs.rng.Keys` at each tick, bit for bit. They are kept for the ticks that follow,
since a tensor of 100 draws costs no more time than a tensor of one.
"""

from __future__ import annotations

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.envs.rng import Keys, keys

TICKS = 128
"""Ticks that one call draws for."""


class EpisodeDraws:
    """The draws of one episode.

    Attributes:
        asked: Whether a draw was asked for since this was last set to False.
    """

    def __init__(self, seed: int) -> None:
        """Prepare the episode of a seed; nothing is drawn yet."""
        self.seed, self.asked = seed, False
        self._start: Keys | None = None
        self._tables: dict[tuple[int, tuple[int, ...]], tuple[int, Tensor]] = {}

    def at(self, tick: int, trials: int = 1) -> EpisodeKeys:
        """The keys at a tick, counted from 0 at the reset; with several trials, the same ones in each."""
        if self._start is None:
            self._start = keys(self.seed, 1)
        seed = self._start.seed.expand(trials)
        return EpisodeKeys(seed=seed, tick=torch.full_like(seed, tick), draws=self)

    def row(self, tick: int, stream: int, shape: tuple[int, ...]) -> Float64[Tensor, "1 *shape"]:
        """Return the draws of one stream at a tick."""
        first, table = self._tables.get((stream, shape), (0, None))
        if table is None or not first <= tick < first + TICKS:
            first, table = tick, self._table(tick, stream, shape)
            self._tables[stream, shape] = first, table
        return table[tick - first : tick - first + 1]

    def _table(self, first: int, stream: int, shape: tuple[int, ...]) -> Float64[Tensor, "T *shape"]:
        seed = keys(self.seed, 1).seed.expand(TICKS)
        ticks = torch.arange(first, first + TICKS, device=seed.device)
        return Keys(seed=seed, tick=ticks).uniform(stream, *shape)


class EpisodeKeys(Keys):
    """The keys of a tick, whose draws are read from the tables of their episode."""

    draws: EpisodeDraws

    def uniform(self, stream: int, *shape: int) -> Float64[Tensor, "N *shape"]:
        """As `Keys.uniform`."""
        self.draws.asked = True
        if len(self.seed) == 1:
            return self.draws.row(int(self.tick), stream, shape)
        return super().uniform(stream, *shape)

    def at(self, stream: int, place: Int64[Tensor, "K"]) -> Float64[Tensor, "N K"]:
        """As `Keys.at`."""
        self.draws.asked = True
        return super().at(stream, place)
