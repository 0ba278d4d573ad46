"""The ways in which a parent errs (ours): what each is, its numbers, and when it answers wrongly.

Section 3.1.3 has a parent who never errs. Here are the teachers of B-Pref (Lee et al. 2021, arXiv 2111.03026:
stochastic, myopic, equal, skip, mistake) and more of their kind, over the exact advantages of Eq. (7).
The web checks a parent's text by these classes, so none of them needs torch before it is asked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from parenting.agent.choice import Choice

if TYPE_CHECKING:
    from jaxtyping import Float64, Int64
    from torch import Tensor

    from parenting.parents.asked import Asked


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
        first, second = asked.draws(place)
        return asked.wrong(choice, second).where(first < self.chance(asked), choice)

    @abstractmethod
    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        """Return the chance of a wrong answer."""


class Noisy(Wrong):
    """Wrong at a fixed rate, whatever is asked: slips, drawn again for every question (B-Pref: mistake)."""

    name = "noisy"
    eps: float = Field(0.1, ge=0, le=1, description="Chance of a wrong answer.")

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        return asked.gap.new_full(asked.gap.shape, self.eps)


class Adversarial(Noisy):
    """Wrong on purpose: as *noisy*, always unless said otherwise."""

    name = "adversarial"
    eps: float = Field(1.0, ge=0, le=1, description="Chance of a wrong answer.")


class Misconceived(Noisy):
    """Wrong about some pairs, and then each time that they are asked, either way round."""

    name = "misconceived"

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        return super().change(asked.by_pair(), choice, place)


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
        return (self.eps * asked.likeness).clamp_max(0.5)


class Tiring(Wrong):
    """Wrong more often the more it has answered."""

    name = "tiring"
    eps: float = Field(0.3, ge=0, le=1, description="Chance of a wrong answer in the end.")
    half: float = Field(50.0, gt=0, description="Answers after which half of that chance is reached.")

    def chance(self, asked: Asked) -> Float64[Tensor, "N"]:
        rested: Float64[Tensor, "N"] = 0.5 ** (asked.answers.double() / self.half)
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
        return choice.masked_fill(equal, Choice.EITHER)


class Aside(Part):
    """Now and then gives an answer that has nothing to do with the clips."""

    p: float = Field(0.2, ge=0, le=1, description="Chance of it.")

    def change(self, asked: Asked, choice: Int64[Tensor, "N"], place: int) -> Int64[Tensor, "N"]:
        first, second = asked.draws(place)
        now = (first < self.p) & (choice != Choice.NONE)
        return self.said(second).where(now, choice)

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
        return _every(draw, Choice.RIGHT).masked_fill(draw < 0.5, Choice.LEFT)


class Skipping(Aside):
    """Cannot tell now and then (B-Pref: skip)."""

    name = "skipping"

    def said(self, draw: Float64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        return _every(draw, Choice.SKIP)


def _every(draw: Float64[Tensor, "N"], choice: Choice) -> Int64[Tensor, "N"]:
    return draw.long().fill_(choice)


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
