"""Locked Door (ours): a key opens the doors, and lava ends the episode. No torch here."""

from __future__ import annotations

from parenting.envs.levels.rules import edge_closed, goal_in_reach, one, reachable
from parenting.envs.levels.spec import WALL, Brief, Cell, Level, Setting, WorldSpec

HALL = """\
#######
#A L K#
#  L  #
#     #
###D###
#    G#
#######
"""

LEVELS = {"hall": HALL}

LEGEND = {"#": "wall", " ": "land", "K": "key", "D": "door", "L": "lava", "G": "goal", "A": "agent"}
"""Glyph -> tile. The order gives the codes: 0 wall, 1 land, 2 key, 3 door, 4 lava, 5 goal, 6 agent."""

WALLS = WALL + "D"
"""Codes that stop the agent: a door, too, as long as it is there."""

ENDS = "GL"
"""Codes that end an episode: the goal, and the lava."""

BRIEF = Brief(
    goal="The agent should fetch the key, which opens the door, and walk to the goal.",
    danger="Lava: an agent that enters it burns, and the episode ends.",
)

DEFAULTS: dict[str, Setting] = {"gamma": 1.0, "max_episode_steps": 100, "pretrain": False}


def reach(level: Level) -> set[Cell]:
    """Every cell that the agent can come to: past the doors, if it can come to the key."""
    locked = reachable(level, ENDS, WALLS)
    return reachable(level, ENDS) if locked & set(level.find("K")) else locked


def validate(level: Level) -> None:
    """One goal, one key, at least one door; the goal in reach; no way to the board's edge.

    Raises:
        LevelError: names source, line, column and the rule.
    """
    goal = one(level, "G", "goal")
    one(level, "K", "key")
    if not level.find("D"):
        raise level.wrong((0, 0), "a level needs a door (D), and this one has none")
    found = reach(level)
    goal_in_reach(level, found, goal)
    edge_closed(level, found, ENDS)


SPEC = WorldSpec(
    name="locked-door",
    title="Locked Door",
    rules="parenting.envs.locked_door:LockedDoor",
    legend=LEGEND,
    levels=LEVELS,
    brief=BRIEF,
    defaults=DEFAULTS,
    validate=validate,
    reach=reach,
    harm="lava",
    colours={"key": (240, 228, 66), "door": (150, 90, 40), "lava": (204, 51, 17)},
)
