"""The cost of a run's ticks and checkpoints, estimated before it starts (ours). No torch here.

Both grow with the policy's dense layer, and so with the board: 62 x 62 cells make twelve million weights.
"""

from __future__ import annotations

from typing import NamedTuple

from parenting.agent.architecture import weights_of
from parenting.agent.config import Config
from parenting.envs.levels.spec import Level, WorldSpec, maze_legend

TICK_SECONDS, SECONDS_A_WEIGHT = 0.01, 5e-8
"""A tick on one core after some twenty answers: of a small board, and for each weight of the policy."""
LATE = 4.0
"""A tick after a hundred answers takes so many times as long as one after twenty (docs/worlds.md)."""
RECORDINGS = 2 * 4096
"""Clips of both kinds that a recorder may hold."""
NOTABLE_SECONDS, NOTABLE_MEGABYTES = 0.1, 10.0
"""Costs from which on they are worth a sentence."""


class Cost(NamedTuple):
    """The estimate for one run."""

    tick_seconds: float  # after some twenty answers; the first ticks take less
    megabytes: float  # of a checkpoint, once the recorder is full

    def __str__(self) -> str:
        """Return the sentence that tells it."""
        early, late = f"{self.tick_seconds:.2g}", f"{self.late_seconds:.2g}"
        return (
            f"a tick takes {early} s after twenty answers and {late} s after a hundred, and a checkpoint has"
            f" up to {self.megabytes:.0f} MB"
        )

    @property
    def late_seconds(self) -> float:
        """The seconds of a tick late in a run: X has grown, and the policy is evaluated between ticks."""
        return LATE * self.tick_seconds

    @property
    def notable(self) -> bool:
        """Return whether somebody who starts the run should be told."""
        return self.tick_seconds >= NOTABLE_SECONDS or self.megabytes >= NOTABLE_MEGABYTES


class Bound(NamedTuple):
    """The most that a run may cost."""

    tick_seconds: float = 2.0
    megabytes: float = 500.0

    def misfits(self, field: str, cost: Cost) -> list[tuple[str, str]]:
        """Return why a run is too expensive, as an error of a field; none where it is not."""
        if cost.tick_seconds <= self.tick_seconds and cost.megabytes <= self.megabytes:
            return []
        said = (
            f"It is too expensive: {cost}, and at most {self.tick_seconds:g} s and {self.megabytes:g} MB are"
            " allowed. Take a smaller level or fewer stages, or raise PARENTING_TICK_SECONDS or"
            " PARENTING_CHECKPOINT_MEGABYTES."
        )
        return [(field, said)]


BOUND = Bound()
"""The default."""


def estimate(spec: WorldSpec, level: Level, config: Config) -> Cost:
    """Return the cost of a tick and a checkpoint; of small boards' ticks rather too much (docs/worlds.md).

    Args:
        spec: The world.
        level: The level that the agent lives on.
        config: The hyperparameters: stages, precision, pre-training.
    """
    weights = weights_of(level.height, level.width, len(maze_legend(spec.glyphs)))
    width, stages = (8 if config.dtype == "float64" else 4), config.max_clip_length
    copies = 3 + (stages - 1) + (2 if config.pretrain else 0)  # with both moments of Adam, frozen policies
    clips = RECORDINGS * (stages + 1) * (level.height * level.width + 4)
    familiarity = 8 * len(spec.glyphs) ** 4
    return Cost(
        tick_seconds=TICK_SECONDS + SECONDS_A_WEIGHT * weights,
        megabytes=(weights * width * copies + clips + familiarity) / 1e6,
    )
