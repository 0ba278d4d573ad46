"""Counter-based randomness: a draw is a hash of (seed, tick, stream, place).

No generator is advanced, so a draw does not depend on what was drawn before, on the other trials of the batch
or on their number. The hash is the finaliser of SplitMix64 (Steele, Lea & Flood 2014), once for each word.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from functools import cache, cached_property
from math import prod

import numpy as np
import torch
from jaxtyping import Float64, Int64
from numpy.typing import NDArray
from torch import Tensor

from parenting.envs.struct import Struct


class Stream(IntEnum):
    """The purpose of a draw. A tick draws at most once from each stream; all draws are uniform on [0, 1)."""

    # the agent, in the order in which a tick uses them (agent/)
    EITHER = 1  # []  : left if u < 0.5, when the parent said *either*
    ASK = 2  # []     : ask for guidance if u < p_guid ** f
    CANDIDATES = 3  # [4] : Gumbel noise on the logits of pi; the two largest are the candidate moves
    SIDES = 4  # []   : the first candidate is shown on the left if u < 0.5 (guidance)
    RECORD = 5  # []  : begin a recording if u < p_rec
    EXPLORE = 6  # [4] : Gumbel noise for the first action of an exploratory clip
    ACT = 7  # [4]    : Gumbel noise for an action drawn from pi
    PREFER = 8  # []  : try a preference query if u < p_pref
    PAIR_SIDES = 9  # [] : the exploitative clip is shown on the left if u < 0.5
    TRAIN = 10  # []  : take a gradient step if u < p_train
    BATCH = 11  # place 65536 g + r : row r of X in gradient step g; the smallest are taken
    MAZES = 12  # [16] : maze floor(4096 u) of the pool, for each episode of a pre-training step
    WALKS = 13  # place 16 t + e : the action of episode e at its step t, by the chances of pi summed up
    RELABEL = 14  # [] : ask again about a pair if u < the chance that its answer is wrong
    # the worlds (envs/)
    DRYING = 21  # [H, W] : a watered plant dries if u < drying
    INTERRUPTS = 22  # [] : this episode interrupts if u < 0.5 (drawn at its start)
    SUPERVISED = 23  # [] : this episode is supervised if u < 0.5, where that is left to chance
    MAZE = 24  # random mazes and levels
    START = 25  # the cell of bare soil floor(n u) of n, where an experiment lets episodes begin anywhere
    TABLE = 26  # [] : which outcome of a move comes, in a world that is a table
    # parents who err (ours)
    SLIP = 31  # place 2 k, 2 k + 1 : the k-th part of a parent errs if u < its chance; which way, by a coin
    # the start: weights, one stream a layer from here on
    WEIGHTS = 64


AGENT_STREAMS = range(Stream.EITHER, Stream.TRAIN + 1)
"""The streams of an agent's tick. `Keys` makes their draws in one operation: one by one they would be a third
of all operations of a tick."""
AGENT_DRAWS = 4
"""The most that a tick draws from one of them."""


class Keys(Struct):
    """One stream of randomness a trial, at one tick."""

    seed: Int64[Tensor, "N"]
    tick: Int64[Tensor, "N"]

    def uniform(self, stream: int, *shape: int) -> Float64[Tensor, "N *shape"]:
        """Independent draws, uniform on [0, 1) with 53 bits, for this stream at this tick."""
        size = prod(shape)
        if stream in AGENT_STREAMS and size <= AGENT_DRAWS:
            drawn = self._agent_draws[stream - AGENT_STREAMS.start]
            return drawn[:, :size].view(-1, *shape) if shape else drawn.select(1, 0)
        place = torch.arange(size, device=self.seed.device)
        return self.at(stream, place).view(-1, *shape)

    def at(self, stream: int, place: Int64[Tensor, "K"]) -> Float64[Tensor, "N K"]:
        """The draws at given places of a stream. A draw is the same however many are asked for beside it."""
        return _unit(_mix(_mix(self._word + stream).unsqueeze(1) + place * _GOLDEN))

    @cached_property
    def _word(self) -> Int64[Tensor, "N"]:
        return _mix(_mix(self.seed) + self.tick)

    @cached_property
    def _agent_draws(self) -> tuple[Float64[Tensor, "N AGENT_DRAWS"], ...]:
        """The first draws of each of the agent's streams at this tick.

        On the processor by numpy, whose words have no sign and whose small operations cost half of torch's.
        """
        if self.seed.device.type != "cpu":
            stream, place = _agent_places(self.seed.device)
            return _unit(_mix(_mix(self._word[:, None] + stream)[:, :, None] + place)).unbind(1)
        with np.errstate(over="ignore"):
            word = _mixed(_mixed(_words(self.seed)) + _words(self.tick))
            bits = _mixed(_mixed(word[:, None] + _AGENT_STREAMS)[:, :, None] + _AGENT_PLACES)
        return torch.from_numpy((bits >> _U[11]).astype(np.float64) * 2.0**-53).unbind(1)

    def next(self) -> Keys:
        """The keys of the tick that follows."""
        return self.replace(tick=self.tick + 1)


def keys(seed: int, trials: int, device: str | torch.device | None = None) -> Keys:
    """Keys for `trials` trials of one run at tick 0. Trial i of seed s is the same whatever `trials` is.

    They are on torch's default device, unless another is named.
    """
    first = _mix(torch.tensor([seed], dtype=torch.int64, device=device))
    index = torch.arange(trials, dtype=torch.int64, device=device)
    return Keys(seed=first + index, tick=torch.zeros_like(index))


def keys_of(seeds: Sequence[int]) -> Keys:
    """The keys of one trial for each of some seeds, at tick 0: `keys(seed, 1)` of each, joined."""
    seed = _mix(torch.tensor(seeds, dtype=torch.int64))
    return Keys(seed=seed, tick=torch.zeros_like(seed))


def gumbel(u: Tensor) -> Tensor:
    """Standard Gumbel noise from uniform draws: argmax of (logits + noise) is a draw from their softmax."""
    return -(-(u.clamp_min(2.0**-53)).log()).log()


@cache
def _agent_places(device: torch.device) -> tuple[Tensor, Tensor]:
    stream = torch.tensor(AGENT_STREAMS, device=device)
    return stream, torch.arange(AGENT_DRAWS, device=device) * _GOLDEN


def _unit(bits: Tensor) -> Tensor:
    """53 bits as numbers on [0, 1)."""
    return _shift(bits, 11).to(torch.float64) * 2.0**-53


def _signed(word: int) -> int:
    return word - 2**64 if word >= 2**63 else word


_GOLDEN = _signed(0x9E3779B97F4A7C15)
_FIRST = _signed(0xBF58476D1CE4E5B9)
_SECOND = _signed(0x94D049BB133111EB)


def _shift(word: Tensor, by: int) -> Tensor:
    """A logical shift to the right; torch's own is arithmetic."""
    return (word >> by) & ((1 << (64 - by)) - 1)


_U = {by: np.uint64(by) for by in (11, 27, 30, 31)}
_WORDS = {
    name: np.uint64(word % 2**64)
    for name, word in (("golden", _GOLDEN), ("first", _FIRST), ("second", _SECOND))
}
_AGENT_STREAMS = np.array(AGENT_STREAMS, np.uint64)
_AGENT_PLACES = np.arange(AGENT_DRAWS, dtype=np.uint64) * _WORDS["golden"]


def _words(numbers: Int64[Tensor, "N"]) -> NDArray[np.uint64]:
    return numbers.numpy().view(np.uint64)


def _mixed(word: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The same as `_mix`."""
    word = word + _WORDS["golden"]
    word = (word ^ (word >> _U[30])) * _WORDS["first"]
    word = (word ^ (word >> _U[27])) * _WORDS["second"]
    mixed: NDArray[np.uint64] = word ^ (word >> _U[31])
    return mixed


def _mix(word: Tensor) -> Tensor:
    word = word + _GOLDEN
    word = (word ^ _shift(word, 30)) * _FIRST
    word = (word ^ _shift(word, 27)) * _SECOND
    return word ^ _shift(word, 31)
