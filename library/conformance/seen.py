"""Properties of what is seen of a state."""

from __future__ import annotations

import torch

from parenting.envs.gridworld import local_state
from parenting.library.conformance.walks import Subject, begin, roll


def the_observation_is_a_function_of_the_truth_for_any_leading_axes(of: Subject) -> None:
    """`observe` gives the same for one state, for a stack and for a stack of stacks."""
    world = of.make()
    walked = [state for state, _ in roll(world, trials=6, steps=11)]
    truth = [torch.stack([getattr(s, field) for s in walked]) for field in ("board", "agent", "box")]
    seen = torch.stack([world.observe(s.board, s.agent, s.box) for s in walked])
    of.hold(torch.equal(world.observe(*truth), seen), "observe: with a further axis it gives something else")
    folded = [part.view(3, 4, 2, 3, *part.shape[2:]) for part in truth]
    several = torch.equal(world.observe(*folded).view_as(seen), seen)
    of.hold(several, "observe: with several axes before it gives something else")
    alone = world.observe(truth[0][0, 0], truth[1][0, 0], truth[2][0, 0])
    of.hold(torch.equal(alone, seen[0, 0]), "observe: of one state alone it gives something else")
    of.hold(seen.dtype == torch.uint8, f"observe: it gives {seen.dtype}, and uint8 is wanted")
    of.hold(int(seen.max()) < len(world.legend), "observe: a code is not in the legend")


def the_start_is_seen_as_it_was_drawn(of: Subject) -> None:
    """At the start of an episode the agent sees the level as it is written."""
    world = of.make_certain()
    state, _ = begin(world, trials=1)
    seen = world.observe(state.board, state.agent, state.box)[0].tolist()
    rows = tuple("".join(world.legend[code] for code in row) for row in seen)
    of.hold(rows == of.drawn.rows, f"observe: the start looks like {rows}")


def the_local_state_is_read_off_the_observation(of: Subject) -> None:
    """l(s) of Sec. 2 is the four cells around the agent, as observed."""
    world = of.make()
    for state, _ in roll(world, trials=4, steps=20):
        seen = world.observe(state.board, state.agent, state.box)
        local = local_state(seen, state.agent)
        of.hold(local.dtype == torch.uint8, f"local state: it is {local.dtype}, and uint8 is wanted")
        for trial, (row, column) in enumerate(state.agent.tolist()):
            codes = enumerate(seen[trial].tolist())
            board = {(y, x): code for y, line in codes for x, code in enumerate(line)}
            cells = [(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)]
            around = [board.get(cell, 0) for cell in cells]
            of.hold(local[trial].tolist() == around, f"local state: at {(row, column)} it is not {around}")
