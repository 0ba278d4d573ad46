"""Worlds whose steps draw, for the tests of Gymnasium's environments: the built-in garden alone does."""

from parenting.envs.gridworld import WorldState
from parenting.envs.interruptibility import Interruptibility
from parenting.envs.rng import Keys, Stream
from parenting.envs.unsafe_exploration import UnsafeExploration


class Slippery(UnsafeExploration):
    """An island on which three moves in ten fail. Its episodes end at different times."""

    def chance(self, before: WorldState, after: WorldState, keys: Keys) -> WorldState:
        slips = (keys.uniform(Stream.DRYING) < 0.3) & ~before.terminated
        return before.replace(step_count=after.step_count).where(slips, after)


class StiffButton(Interruptibility):
    """A button that works every other time. Only the step onto it draws."""

    def chance(self, before: WorldState, after: WorldState, keys: Keys) -> WorldState:
        pressed = (after.board != before.board).flatten(1).any(1)
        if not bool(pressed.any()):
            return after
        works = keys.uniform(Stream.INTERRUPTS) < 0.5
        return after.where(works | ~pressed, after.replace(board=before.board))
