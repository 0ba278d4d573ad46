"""The questions that a parent who errs is asked, and the draws that its errors are made of (ours)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.agent.query import Choice, Query
from parenting.envs.fingerprint import fingerprint, together
from parenting.envs.rng import Keys, Stream

OTHER = torch.tensor([Choice.NONE, Choice.RIGHT, Choice.LEFT, Choice.EITHER, Choice.NEITHER, Choice.SKIP])
"""Each choice with its sides exchanged."""


class Asked(NamedTuple):
    """The knowledge that a parent has of the questions of N trials."""

    query: Query
    gap: Float64[Tensor, "N"]  # the advantage of the left clip less that of the right one
    refuses: Bool[Tensor, "N"]  # both moves of guidance are unsafe
    keys: Keys  # of each trial, at the tick in which it asked
    answers: Int64[Tensor, "N"]  # that the parent has given before

    def draws(self, place: int) -> tuple[Float64[Tensor, "N"], Float64[Tensor, "N"]]:
        """Return two draws for the part of this place: whether it errs, and how."""
        first, second = self.keys.at(Stream.SLIP, 2 * place + torch.arange(2, device=self.gap.device)).unbind(
            1
        )
        return first, second

    def by_pair(self) -> Asked:
        """Return the same with draws that are equal whenever this state and pair are asked about."""
        return self._replace(keys=self.keys.replace(tick=_pair_word(self.query)))

    def wrong(self, choice: Int64[Tensor, "N"], draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        """Return a wrong answer: the worse side, or where neither is worse, a side by a coin.

        The coin names a move rather than a place on the screen, so that a mirrored question gives the same.
        """
        lower_left = self.query.action[:, 0, 0] < self.query.action[:, 1, 0]
        coin = torch.where((draw < 0.5) == lower_left, int(Choice.LEFT), int(Choice.RIGHT))
        sides = (choice == Choice.EITHER) | (choice == Choice.NEITHER)
        return torch.where(sides, coin, OTHER.to(choice.device)[choice])

    @property
    def likeness(self) -> Float64[Tensor, "N"]:
        """Return the likeness of the clips: 1 if they end on diagonal neighbours, 0 if two cells apart."""
        last = self.query.length[:, :, None, None].expand(-1, -1, 1, 2)
        ends = self.query.agent.gather(2, last).squeeze(2).double()
        apart = (ends[:, 0] - ends[:, 1]).square().sum(1).sqrt()
        return ((2 - apart) / (2 - 2**0.5)).clamp_min(0)


def _pair_word(query: Query) -> Int64[Tensor, "N"]:
    """Return a number of the state and the unordered pair of first moves, for guidance and clips alike."""
    state = query.board[:, 0, 0].flatten(1), query.agent[:, 0, 0], query.box[:, 0, 0]
    moves = (1 << query.action[:, :, 0]).sum(1)
    return together(*map(fingerprint, state), moves, query.level)
