"""The part of a table of transition probabilities that an episode can come to, as outcomes of four moves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from math import isfinite

from parenting.envs.tables.layers import Boards
from parenting.envs.tables.table import MOST_STATES, Outcome

Transitions = Mapping[int, Mapping[int, Sequence[tuple[float, int, float, bool]]]]
"""P[state][action]: outcomes (probability, next state, reward, whether the episode ends), as in Gymnasium."""
Unsafe = str | Collection[int] | Callable[[int, int, int, float], bool]
"""Glyphs of tiles, states, or a function of (state, move, next state, reward)."""
LONGEST_CHAIN = 8
"""Actions at most that a table adds to a move by itself."""
ROUNDING = 1e-6
"""A probability may exceed 1 by so much, as sums of floats do."""

Step = list[tuple[float, int, float, bool]]


def reached(
    transitions: Transitions, start: int, moves: Sequence[int], then: Callable[[int], int | None] | None
) -> tuple[dict[int, list[Step]], dict[int, int]]:
    """Return the outcomes of the four moves in each state that the start leads to, and a number for each.

    Raises:
        ValueError: an action or a state is missing, there are more actions than moves, or too many states.
    """
    if start < 0:
        raise ValueError(f"start: {start} is not a state; states are whole numbers from 0.")
    number, steps, fringe = {start: 0}, dict[int, list[Step]](), [start]
    ended: set[int] = set()
    while fringe:
        state = fringe.pop(0)
        if state in ended:
            steps[state] = [[], [], [], []]
            continue
        steps[state] = [_merged(_followed(transitions, state, action, then)) for action in moves]
        for _, after, _, over in (one for step in steps[state] for one in step):
            if over:
                ended.add(after)
            if after not in number:
                number[after] = len(number)
                fringe.append(after)
        if len(number) > MOST_STATES:
            raise ValueError(f"P: more than {MOST_STATES} states can be reached from state {start}.")
    return steps, number


def _followed(
    transitions: Transitions, state: int, action: int, then: Callable[[int], int | None] | None
) -> Step:
    """Return the outcomes of a move, with what happens by itself after it."""
    found, chain = _outcomes(transitions, state, action, then), 0
    while then is not None:
        grown: Step = []
        again = False
        for chance, after, reward, over in found:
            further = None if over else then(after)
            if further is None:
                grown.append((chance, after, reward, over))
                continue
            again = True
            more = _outcomes(transitions, after, further, then)
            grown += [(chance * p, to, reward + extra, end) for p, to, extra, end in more]
        found, chain = grown, chain + 1
        if not again:
            return found
        if chain > LONGEST_CHAIN:
            raise ValueError(f"then: after action {action} in state {state} it never comes to an end.")
    return found


def _outcomes(
    transitions: Transitions, state: int, action: int, then: Callable[[int], int | None] | None
) -> Step:
    try:
        told = transitions[state]
        found = told[action]
    except (KeyError, IndexError, TypeError):
        raise ValueError(f"P[{state}][{action}] is missing.") from None
    if len(told) > 4 and then is None:
        raise ValueError(
            f"P[{state}] has {len(told)} actions, and an agent has four moves. Say by then= which of the"
            " others happen by themselves after a move."
        )
    outcomes = [_outcome(f"P[{state}][{action}]", one) for one in found]
    return [one for one in outcomes if one[0] > 0]


def _outcome(where: str, told: Sequence[float]) -> tuple[float, int, float, bool]:
    """Return an outcome of a table.

    Raises:
        ValueError: it is not made of four parts, or one of them cannot be what it should be.
    """
    try:
        p, after, reward, over = told
        chance, state, worth = float(p), int(after), float(reward)
    except (TypeError, ValueError, OverflowError):
        wanted = "(probability, next state, reward, whether the episode ends)"
        raise ValueError(f"{where}: {str(told)[:80]} is not {wanted}.") from None
    if not 0 <= chance <= 1 + ROUNDING:
        raise ValueError(f"{where}: {chance:g} is not a probability.")
    if state != after or state < 0:
        raise ValueError(f"{where} leads to state {after}, and states are whole numbers from 0.")
    if not isfinite(worth):
        raise ValueError(f"{where}: {worth} is not a reward; it has to be finite.")
    return chance, state, worth, bool(over)


def _merged(step: Step) -> Step:
    """Return the outcomes with those that lead to one state as one, with their mean reward."""
    found: dict[tuple[int, bool], tuple[float, float]] = {}
    for chance, after, reward, over in step:
        had, worth = found.get((after, over), (0.0, 0.0))
        found[after, over] = had + chance, worth + chance * reward
    return [(p, after, worth / p, over) for (after, over), (p, worth) in found.items()]


def states_of(unsafe: Unsafe) -> Collection[int]:
    """Return the unsafe states, where states are given."""
    return () if callable(unsafe) or isinstance(unsafe, str) else unsafe


def harmful(unsafe: Unsafe) -> Callable[[Boards, int, int, int, float], bool]:
    """Return whether a step (boards, state, move, next state, reward) is unsafe."""
    if callable(unsafe):
        return lambda _boards, state, move, after, reward: bool(unsafe(state, move, after, reward))
    if isinstance(unsafe, str):
        return lambda boards, _state, _move, after, _reward: boards.drawn[after] in unsafe
    return lambda _boards, _state, _move, after, _reward: after in unsafe


def numbered(
    steps: Mapping[int, list[Step]],
    number: Mapping[int, int],
    harms: Callable[[int, int, int, float], bool],
) -> tuple[tuple[tuple[Outcome, ...], ...], ...]:
    """Return the outcomes by the states' new numbers."""

    def outcome(state: int, move: int, p: float, after: int, reward: float, over: bool) -> Outcome:
        return Outcome(min(p, 1.0), number[after], reward, over, harms(state, move, after, reward))

    return tuple(
        tuple(tuple(outcome(state, move, *one) for one in step) for move, step in enumerate(steps[state]))
        for state in number
    )
