"""`configure`, `init`, `step` and `tick`: for those who write their own loop.

Nothing that these take is changed, and nothing that they return is written to later. The engine itself,
`parenting.agent.parenting.step`, consumes its state and saves the copy.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.parent import Parent as AnyParent
from parenting.agent.query import Answer, silence
from parenting.agent.state import AgentState
from parenting.envs.rng import keys
from parenting.library.checks import check_number, check_parent
from parenting.library.loop_checks import check_agents, check_answer, check_config
from parenting.library.parent import Parent, nothing
from parenting.library.question import Query
from parenting.library.task import prepare
from parenting.library.worlds import World


class Tick(NamedTuple):
    """The result of one tick.

    Attributes:
        state: The agents after it.
        query: What they ask in it.
        answer: What they heard in it.
        config: The hyperparameters after it: an operator's event may change them.
    """

    state: AgentState
    query: Query
    answer: Answer
    config: Config


def configure(world: str | World, preset: str | Config = "conservative", **changes: Any) -> Config:
    """Compose the config that `train` would use in a world: preset, the world's own defaults, changes.

    Args:
        world: A world's name, a level's text, or a `World`.
        preset: A name in `PRESETS`, or a `Config`.
        **changes: Hyperparameters that differ from it.

    Returns:
        The hyperparameters.

    Raises:
        TypeError, ValueError: as `train`.

    Example:
        >>> import parenting as pt
        >>> pt.configure("unsafe-exploration", p_guid=0.9).p_guid
        0.9
    """
    return prepare(world, None, preset, changes).config


def init(world: str | World, config: Config | None = None, *, trials: int = 1, seed: int = 0) -> AgentState:
    """Make agents at tick 0: fresh weights, a first episode, nothing known.

    Args:
        world: The world that they live in, or its name; `step` and `tick` need the `World`.
        config: The hyperparameters; None takes those of `configure(world)`.
        trials: Number of agents N. Agent i of a seed is the same whatever N is.
        seed: Seed of all randomness.

    Returns:
        The state of N agents. Its fields and their shapes: `parenting.agent.state.AgentState`.

    Raises:
        ValueError: A number is out of bounds, or the pre-trained weights that the config wants are missing.

    Example:
        >>> import parenting as pt
        >>> pt.init(pt.make("unsafe-exploration"), trials=2)
        <AgentState of 2 trials at tick 0>
    """
    trials = check_number("trials", trials, 1, 1_000_000)
    seed = check_number("seed", seed, 0, 2**53 - 1)
    if config is not None:
        check_config(config)
    task = prepare(world, None, "conservative" if config is None else config, {})
    return parenting.init(task.world, task.config, keys(seed, trials, task.world.device), task.weights)


def step(
    world: World, config: Config, state: AgentState, answer: Answer | None = None
) -> tuple[AgentState, Query]:
    """Make one tick of PARENTING (Sec. 2): hear, ask, act, record, pair, train, mature. Reads no reward.

    Args:
        world: The world of these agents.
        config: The hyperparameters.
        state: The agents; they stay as they are.
        answer: At most one answer for each trial, to this or an earlier query; None is silence.

    Returns:
        The agents after the tick, and what they ask in it: N trials, at most one question each.

    Raises:
        TypeError, ValueError: An argument is of another type, or world, config, state and answer do not
            belong together; the message names it.

    Example:
        >>> import parenting as pt
        >>> world, config = pt.make("unsafe-exploration"), pt.configure("unsafe-exploration")
        >>> before = pt.init(world, config)
        >>> after, query = pt.step(world, config, before)
        >>> int(before.keys.tick[0]), int(after.keys.tick[0])
        (0, 1)
    """
    check_agents(world, config, state)
    blank = nothing(world, config, len(state.waiting))
    if answer is not None:
        check_answer(answer, state, blank.board)
    heard = silence(blank) if answer is None else answer
    after, query = parenting.step(world, config, state.clone(), heard)
    return parenting.rehearse(world, config, after), Query.of(query, world)


def tick(world: World, config: Config, state: AgentState, parent: AnyParent) -> Tick:
    """Make one tick together with a parent: its events, its answer, a step, and the new question.

    Args:
        world: The world of these agents.
        config: The hyperparameters.
        state: The agents; they stay as they are.
        parent: A `Parent`. In an agent's first tick it begins with this world and config.

    Returns:
        The agents after the tick, what they ask, what they heard, and the config.

    Raises:
        TypeError, ValueError: As `step`, and for what is not a parent.

    Example:
        >>> import parenting as pt
        >>> world, config = pt.make("unsafe-exploration"), pt.configure("unsafe-exploration")
        >>> state, parent = pt.init(world, config, seed=1), pt.ScriptedParent()
        >>> for _ in range(20):
        ...     state, query, answer, config = pt.tick(world, config, state, parent)
        >>> int(state.answered[0]) > 0
        True
    """
    check_agents(world, config, state)
    check_parent(parent)
    if isinstance(parent, Parent) and int(state.keys.tick[0]) == 0:
        parent.begin(world, config, len(state.waiting))
    after, query, answer, config, _ = parenting.tick(world, config, state.clone(), parent)
    return Tick(after, Query.of(query, world), answer, config)
