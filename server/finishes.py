"""The rule that ends a run: `optimal`, `goal:N`, `stages:T` or `never`, whoever its parent is."""

from __future__ import annotations

import re
from typing import NamedTuple

from parenting.agent.config import Config
from parenting.envs.levels.spec import WorldSpec

PATTERN = r"^(optimal|never|(goal|stages):[1-9][0-9]{0,6})$"
_RULE = re.compile(PATTERN)
KNOWN = "optimal, goal:N, stages:T or never, such as goal:50"


class Finish(NamedTuple):
    """A rule: its kind, and the number of answers or stages."""

    kind: str
    number: int = 0

    @property
    def reason(self) -> str:
        """Return the reason that a run gives once it has ended so."""
        return {
            "optimal": "Its argmax policy is optimal.",
            "goal": f"It has heard {self.number} answers.",
            "stages": f"Stage {self.number} is over.",
        }[self.kind]

    def is_met(self, optimal: bool, heard: int, stage: int, heard_in_stage: int, config: Config) -> bool:
        """Return whether a run has ended by this rule.

        Args:
            optimal: Its argmax policy is optimal.
            heard: The answers that its agent has heard, those that stand.
            stage: Its stage T (Sec. 2.4).
            heard_in_stage: The answers heard in it.
            config: Its config. The last stage never gives way to another: it is over after as many answers
                as end the others.
        """
        match self.kind:
            case "optimal":
                return optimal
            case "goal":
                return heard >= self.number
            case "stages" if stage == self.number == config.max_clip_length:
                return config.queries_per_stage is not None and heard_in_stage >= config.queries_per_stage
            case "stages":
                return stage > self.number
        return False


def read_finish(text: str) -> Finish:
    """Read a rule.

    Raises:
        ValueError: it is none; the message names those that there are.
    """
    if not _RULE.fullmatch(text):
        raise ValueError(f"write {KNOWN}")
    kind, _, number = text.partition(":")
    return Finish(kind, int(number or 0))


def usual(parent: str) -> str:
    """Return the rule of a run that names none: a script teaches until the policy is optimal."""
    return "never" if parent == "human" else "optimal"


def never_met(text: str | None, world: WorldSpec, config: Config) -> list[tuple[str, str]]:
    """Return why a rule that somebody chose is never met in a world and with a config, as a wrong field."""
    finish, stages = read_finish(text or "never"), config.max_clip_length
    last = finish.kind == "stages" and finish.number == stages
    if finish.kind == "optimal" and not world.ends_at_goal:
        said = f"No policy counts as optimal in {world.name}, which has no goal. Write goal:N, for example."
    elif finish.kind == "stages" and finish.number > stages:
        said = f"The run has {stages} {'stage' if stages == 1 else 'stages'} (config.stages)."
    elif last and config.queries_per_stage is None:
        said = "The last stage is over after config.mature_every answers, and that is not set."
    else:
        return []
    return [("finish", said)]
