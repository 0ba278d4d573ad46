"""The ways in which a parent errs (ours): what each is, its numbers, and when it answers wrongly.

Section 3.1.3 has a parent who never errs. Here are the teachers of B-Pref (Lee et al. 2021, arXiv 2111.03026:
stochastic, myopic, equal, skip, mistake) and more of their kind, over the exact advantages of Eq. (7).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

import torch
from jaxtyping import Bool, Float64, Int64
from pydantic import BaseModel, ConfigDict, Field
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


class Part(BaseModel, ABC):
    """One way to err: it changes the answer so far."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    name: ClassVar[str] = ""  # an imported one is written as its path
    judges: ClassVar[bool] = False  # it judges by itself, so it stands first

    @abstractmethod
    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        """Return the answers after this part, which is the `place`-th of its parent."""

    def discount(self, gamma: float) -> float:
        """Return the discount by which the parent judges."""
        return gamma


class Scripted(Part):
    """Never wrong: the parent of Sec. 3.1.3."""

    name = "scripted"
    judges = True

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        return choice


class Wrong(Part):
    """Gives a wrong answer with some chance."""

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        first, second = _draws(asked.keys, place)
        return torch.where(first < self.chance(asked), wrong(asked.query, choice, second), choice)

    @abstractmethod
    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        """Return the chance of a wrong answer."""


class Noisy(Wrong):
    """Wrong at a fixed rate, whatever is asked: slips, drawn again for every question (B-Pref: mistake)."""

    name = "noisy"
    eps: float = Field(0.1, ge=0, le=1, description="Chance of a wrong answer.")

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        return torch.full_like(asked.gap, self.eps)


class Adversarial(Noisy):
    """Wrong on purpose: as *noisy*, always unless said otherwise."""

    name = "adversarial"
    eps: float = Field(1.0, ge=0, le=1, description="Chance of a wrong answer.")


class Misconceived(Noisy):
    """Wrong about some pairs, and then each time that they are asked, either way round."""

    name = "misconceived"

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        same = asked.keys.replace(tick=_pair_word(asked.query))
        return super().change(asked._replace(keys=same), choice, place)


class Boltzmann(Wrong):
    """Prefers a clip with the chance that a softmax of the advantages gives it (B-Pref: stochastic).

    It still refuses where both moves are unsafe.
    """

    name = "boltzmann"
    judges = True
    beta: float = Field(5.0, ge=0, description="Inverse temperature; the larger, the fewer errors.")

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        return (-self.beta * asked.gap.abs()).sigmoid().masked_fill(asked.refuses, 0)


class Likeness(Wrong):
    """Wrong where the clips are alike: the nearer their ends are, the more often, half of the time at most.

    The chance is 0 where the ends are two cells apart or more.
    """

    name = "likeness"
    eps: float = Field(
        0.2, ge=0, le=1, description="Chance of a wrong answer where the ends are diagonal neighbours."
    )

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        return (self.eps * likeness(asked.query)).clamp_max(0.5)


class Tiring(Wrong):
    """Wrong more often the more it has answered."""

    name = "tiring"
    eps: float = Field(0.3, ge=0, le=1, description="Chance of a wrong answer in the end.")
    half: float = Field(50.0, gt=0, description="Answers after which half of that chance is reached.")

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        rested = torch.pow(torch.tensor(0.5, dtype=torch.float64), asked.answers.double() / self.half)
        return self.eps * (1 - rested)


class Myopic(Part):
    """Cares less for what comes later than the paper's parent does (B-Pref: myopic)."""

    name = "myopic"
    judges = True
    gamma: float = Field(0.5, gt=0, lt=1, description="The parent's own discount, instead of the config's.")

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        return choice

    def discount(self, gamma: float) -> float:
        return min(gamma, self.gamma)


class Indifferent(Part):
    """Finds clips equivalent whose advantages differ by little (B-Pref: equal)."""

    name = "indifferent"
    gap: float = Field(1.0, ge=0, description="Gap of the advantages up to which the answer is either.")

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        equal = (asked.gap.abs() <= self.gap) & ~asked.refuses & (choice != Choice.NONE)
        return torch.where(equal, int(Choice.EITHER), choice)


class Aside(Part):
    """Now and then gives an answer that has nothing to do with the clips."""

    p: float = Field(0.2, ge=0, le=1, description="Chance of it.")

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        first, second = _draws(asked.keys, place)
        now = (first < self.p) & (choice != Choice.NONE)
        return torch.where(now, self.said(second), choice)

    @abstractmethod
    def said(self, draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        """Return that answer."""


class Sided(Aside):
    """Says one side now and then without a reason."""

    name = "sided"
    side: Literal["left", "right"] = Field("left", description="left or right.")

    def said(self, draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        return _every(draw, Choice.LEFT if self.side == "left" else Choice.RIGHT)


class Hasty(Aside):
    """Answers now and then before looking: left or right by a coin."""

    name = "hasty"

    def said(self, draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        return torch.where(draw < 0.5, int(Choice.LEFT), int(Choice.RIGHT))


class Skipping(Aside):
    """Cannot tell now and then (B-Pref: skip)."""

    name = "skipping"

    def said(self, draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        return _every(draw, Choice.SKIP)


def wrong(query: Query, choice: Int64[Tensor, "N"], draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
    """Return a wrong answer: the worse side, or where neither is worse, a side by a coin.

    The coin names a move rather than a place on the screen, so that a mirrored question gives the same.
    """
    lower_left = query.action[:, 0, 0] < query.action[:, 1, 0]
    coin = torch.where((draw < 0.5) == lower_left, int(Choice.LEFT), int(Choice.RIGHT))
    sides = (choice == Choice.EITHER) | (choice == Choice.NEITHER)
    return torch.where(sides, coin, OTHER.to(choice.device)[choice])


def _draws(keys: Keys, place: int) -> tuple[Tensor, Tensor]:
    """Return two draws for this part: whether it errs, and how."""
    first, second = keys.at(Stream.SLIP, 2 * place + torch.arange(2, device=keys.seed.device)).unbind(1)
    return first, second


def likeness(query: Query) -> Float64[Tensor, "N"]:
    """Return the likeness of two clips: 1 if they end on diagonal neighbours, 0 if two cells apart."""
    last = query.length[:, :, None, None].expand(-1, -1, 1, 2)
    ends = query.agent.gather(2, last).squeeze(2).double()
    apart = (ends[:, 0] - ends[:, 1]).square().sum(1).sqrt()
    return ((2 - apart) / (2 - 2**0.5)).clamp_min(0)


def _pair_word(query: Query) -> Int64[Tensor, "N"]:
    """Return a number of the state and the unordered pair of first moves, for guidance and clips alike."""
    state = query.board[:, 0, 0].flatten(1), query.agent[:, 0, 0], query.box[:, 0, 0]
    moves = (1 << query.action[:, :, 0]).sum(1)
    return together(*map(fingerprint, state), moves, query.level)


def _every(draw: Float64[Tensor, "N"], choice: Choice) -> Int64[Tensor, "N"]:
    return torch.full_like(draw, int(choice), dtype=torch.int64)


PARTS = {
    part.name: part
    for part in (
        Scripted,
        Noisy,
        Boltzmann,
        Likeness,
        Misconceived,
        Indifferent,
        Myopic,
        Sided,
        Hasty,
        Tiring,
        Skipping,
        Adversarial,
    )
}
"""The parents who err, by name."""
