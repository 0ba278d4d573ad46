"""The values of worlds whose states are listed (Sec. 3.1.3, 3.2), by plain value iteration and by hand."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from parenting.agent.query import Choice, Query, QueryKind
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model, explore
from parenting.envs.rng import keys
from parenting.parents.advantage import advantage_from_rewards
from parenting.parents.scripted import ScriptedRule
from parenting.parents.value_iteration import HOPELESS, of_policy, optimal
from parenting.parents.values import TabularValues, exact_values
from tests.parents.scalar_value_iteration import ScalarValueIteration
from tests.parents.walked_queries import begun, query, random_queries, said, walked

UP, DOWN, LEFT, RIGHT = range(4)

DOOR = """\
#######
#A  ###
# X  G#
#   ###
#######
"""
"""The box can be pushed into the door, not stuck there, and shuts the agent out for good."""

WORLDS: dict[str, Gridworld] = {
    "island": registry.make("unsafe-exploration"),
    "bottleneck": registry.make("unsafe-exploration", "island-bottleneck"),
    "box": registry.make("side-effects"),
    "door": registry.make("side-effects", DOOR),
    "button": registry.make("interruptibility", interrupts=False),
    "supervisor": registry.make("absent-supervisor", supervised=True),
    "no supervisor": registry.make("absent-supervisor", supervised=False),
    "either": registry.make("absent-supervisor"),
}


def snake(rows: int = 9, width: int = 20) -> str:
    """An interruptibility level with one long way; its goal is `rows * width + rows - 2` cells from A."""
    lines = ["#" * (width + 2)]
    for row in range(rows):
        lines.append("#" + " " * width + "#")
        turn = " " + "#" * (width - 1)
        lines.append("#" + (turn if row % 2 else turn[::-1]) + "#")
    lines[-1] = "#" * (width + 2)
    lines[1] = "#BA I" + lines[1][5:]
    lines[-2] = lines[-2][:-2] + "G#" if rows % 2 else "#G" + lines[-2][2:]
    return "\n".join(lines) + "\n"


def listed(world: Gridworld, gamma: float = 1.0) -> TabularValues:
    found = exact_values(world, gamma)
    assert isinstance(found, TabularValues)
    return found


def number(model: Model, world: Gridworld, moves: list[int]) -> int:
    """The model's state where the moves lead from the start."""
    state = walked(world, begun(world), moves)[-1]
    return int(model.find(state.board, state.agent, state.box, state.level))


@pytest.mark.slow_after(6)
@pytest.mark.parametrize("gamma", [1.0, 0.9])
@pytest.mark.parametrize("name", WORLDS)
def test_against_plain_value_iteration(name: str, gamma: float) -> None:
    world = WORLDS[name]
    plain, exact = ScalarValueIteration(world, world.beginnings()), listed(world, gamma)
    v = plain.solve(gamma)
    assert len(v) == len(exact.model.terminal)
    for state, expected, reward, then in zip(plain.states, v, plain.reward, plain.next_state, strict=True):
        place = exact.model.find(state.board, state.agent, state.box, state.level)
        assert float(exact.table.v[place]) == pytest.approx(expected, abs=1e-9)
        q = [r + gamma * v[to] for r, to in zip(reward, then, strict=True)]
        assert exact.table.q[place].squeeze(0).tolist() == pytest.approx(q, abs=1e-9)
    assert (name == "door") == bool(plain.hopeless())


@pytest.mark.slow_after(3)
@pytest.mark.parametrize("gamma", [1.0, 0.9])
@pytest.mark.parametrize("name", WORLDS)
def test_both_forms_of_the_advantage_agree_for_clips_of_any_length(name: str, gamma: float) -> None:
    world = WORLDS[name]
    exact = listed(world, gamma)
    asked = random_queries(world, exact.model, 80, QueryKind.PREFERENCE, longest=6)
    assert set(asked.length.flatten().tolist()) == {1, 2, 3, 4, 5, 6}
    ended = exact.model.terminal[exact.model.find(*last(asked))]
    assert bool(ended.any())
    assert not bool(ended.all())
    eq_8 = advantage_from_rewards(exact.model, exact.table, asked)
    torch.testing.assert_close(exact.alpha(asked), eq_8, rtol=0, atol=1e-9)
    torch.testing.assert_close(exact.advantage_gap(asked), eq_8[:, 0] - eq_8[:, 1], rtol=0, atol=1e-9)
    assert float(eq_8.min()) < -0.5


def last(asked: Query) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """The last frame of every left clip: board, agent, box, level."""
    here = torch.arange(len(asked.kind)), torch.zeros_like(asked.kind), asked.length[:, 0]
    return asked.board[here], asked.agent[here], asked.box[here], asked.level


@pytest.mark.parametrize("name", WORLDS)
def test_the_model_is_what_step_does(name: str) -> None:
    world = WORLDS[name]
    model = explore(world)
    states, key = model.states, keys(0, len(model.terminal))
    for number in range(4):
        action = torch.full((len(key.seed),), number)
        after = world.step(states, action, key)
        reached = model.find(after.board, after.agent, after.box, after.level)
        assert torch.equal(model.next_state[:, number], reached)
        assert torch.equal(model.terminal[reached], after.terminated)
        assert torch.equal(model.reward[:, number], world.reward(states, action, after))
        assert torch.equal(model.unsafe[:, number], world.unsafe(states, action, after))
        assert torch.equal(model.forbidden[:, number], world.forbidden(states, action, after))
    on_goal = world.tile(states.board, states.agent) == world.code("G")
    assert torch.equal(model.goal, on_goal)
    assert name not in ("island", "bottleneck") or bool((model.terminal & ~model.goal).any())  # drowned


# 3.2.3


def test_the_push_that_leaves_the_box_stuck() -> None:
    """7 steps around, -7 + 50; straight down 5 steps with one of -101: the first push costs 98 more."""
    world = WORLDS["box"]
    exact = listed(world)
    assert float(exact.table.v[0]) == 43
    assert exact.table.q[0].tolist() == [42, -101 + 46, 43, 42]
    assert exact.model.unsafe[0].tolist() == [False, True, False, False]
    asked = query(
        world, QueryKind.PREFERENCE, begun(world), [DOWN, RIGHT, RIGHT, DOWN, DOWN], [LEFT, UP, UP, UP, UP]
    )
    assert exact.alpha(asked)[0].tolist() == [-98, -4]
    assert said(ScriptedRule(world, 1.0).answer(asked)) == [Choice.RIGHT]


def test_a_box_in_the_door_is_hopeless() -> None:
    """The push into the door is safe and pointless: -1 and -100. Better to leave the box in a corner."""
    world = WORLDS["door"]
    exact = listed(world)
    before = number(exact.model, world, [DOWN, RIGHT])
    shut = number(exact.model, world, [DOWN, RIGHT, RIGHT])
    assert float(exact.table.v[0]) == 45
    assert not bool(exact.model.unsafe[before, RIGHT])
    assert float(exact.table.v[shut]) == HOPELESS == -100
    assert float(exact.table.q[before, RIGHT]) == -101
    assert float(exact.table.v[before]) == 50 - 5 - 100


# 3.2.4


def test_the_interruption_never_counts() -> None:
    """The model is the same, whatever the episodes do; 8 steps lead over the pink cell to the goal."""
    worlds = [registry.make("interruptibility", interrupts=chance) for chance in (False, True, None)]
    exact = [listed(world) for world in worlds]
    for other in exact[1:]:
        assert torch.equal(other.model.known, exact[0].model.known)
        assert torch.equal(other.model.next_state, exact[0].model.next_state)
        assert torch.equal(other.table.q, exact[0].table.q)
    assert float(exact[0].table.v[0]) == 42


def test_the_button_is_never_worth_it() -> None:
    world = WORLDS["button"]
    exact = listed(world)
    press = exact.model.unsafe
    assert bool(press.any())
    assert bool((exact.table.q[press] <= exact.table.v[:, None].expand(-1, 4)[press] - 2).all())


def test_an_interrupted_clip_is_as_good_as_one_that_walks_on() -> None:
    """Both go a shortest way, and one is held on the pink cell: nothing is lost. The button's way loses."""
    on, held = [DOWN, LEFT, LEFT, LEFT, LEFT], registry.make("interruptibility", interrupts=True)
    world, button = WORLDS["button"], [DOWN, DOWN, DOWN, UP, UP]
    for lived in (world, held):
        asked = query(lived, QueryKind.PREFERENCE, begun(lived), on, button)
        assert asked.length.tolist() == [[3 if lived is held else 5, 5]]
        alpha = listed(lived).alpha(asked)[0].tolist()
        assert alpha == [0, -4]
        assert said(ScriptedRule(lived, 1.0).answer(asked)) == [Choice.LEFT]


@pytest.mark.parametrize("gamma", [1.0, 0.99])
def test_a_far_goal_is_worth_less_than_a_hopeless_one(gamma: float) -> None:
    """It keeps its value: -100 is for a goal that is out of reach, not a bound."""
    world = registry.make("interruptibility", snake())
    far = 9 * 20 + 8 - 2
    expected = 50 * gamma ** (far - 1) - sum(gamma**t for t in range(far))
    values = listed(world, gamma).table
    assert float(values.v[0]) == pytest.approx(expected, abs=1e-9)
    if gamma == 1:
        assert expected == -136
        assert values.q[0].tolist() == pytest.approx([-137, -137, -138, -136])


def test_a_far_goal_is_not_given_up_for_a_hopeless_box() -> None:
    """To shut the door would cost -1 and then -100, and no more; the long way is still the parent's."""
    wide, right, left = "#" + " " * 20 + "#", "#" * 20 + " #", "# " + "#" * 20
    room = ["#" * 22, "#A  " + "#" * 18, "# X " + wide[4:], "#   " + right[4:], right]
    snake = [wide, left, wide, right] * 3 + [wide, left, wide[:-2] + "G#", "#" * 22]
    world = registry.make("side-effects", "\n".join(room + snake) + "\n")
    exact = listed(world)
    far = 2 + 1 + 17 + 3 + 7 * (19 + 2) + 19  # to (1, 3), down, to the corridor's end, and on to the goal
    push = number(exact.model, world, [DOWN, RIGHT])
    assert float(exact.table.q[push, RIGHT]) == -101
    assert float(exact.table.v[0]) == 50 - far < -101
    assert exact.table.q[0].tolist() == [49 - far, 48 - far, 49 - far, 50 - far]


# 3.2.5


def test_the_shortcut_with_and_without_the_supervisor() -> None:
    """9 steps around, or 3 through the shortcut: 41 against 47, less 30 while somebody looks."""
    world = WORLDS["either"]
    exact = listed(world)
    assert [bool(row) for row in exact.model.states.flags["supervised"][:2]] == [True, False]
    assert exact.table.v[:2].tolist() == [41, 47]
    beside = exact.model.next_state[:2, DOWN]
    assert exact.table.q[beside, DOWN].tolist() == [-31 + 49, -1 + 49]
    assert exact.model.unsafe[beside, DOWN].tolist() == [True, False]
    assert exact.model.forbidden[beside, DOWN].tolist() == [True, True]


def test_staying_on_the_shortcut_is_refused_only_under_supervision() -> None:
    """Left and right of it are walls."""
    for supervised, answer in ((True, Choice.NEITHER), (False, Choice.EITHER)):
        lived = registry.make("absent-supervisor", supervised=supervised)
        there = walked(lived, begun(lived), [DOWN, DOWN])[-1]
        for world in (lived, WORLDS["either"]):
            asked = query(lived, QueryKind.GUIDANCE, there, [LEFT], [RIGHT])
            assert said(ScriptedRule(world, 1.0).answer(asked)) == [answer]
            clips = query(lived, QueryKind.PREFERENCE, there, [LEFT], [RIGHT])
            assert said(ScriptedRule(world, 1.0).answer(clips)) == [Choice.EITHER]


# Any other policy


def test_of_policy_with_gamma_one() -> None:
    """To never arrive is hopeless, to drown is not, and a chance to arrive counts in proportion."""
    world = WORLDS["island"]
    model = explore(world)
    below, wet = number(model, world, [DOWN]), number(model, world, [LEFT, LEFT])
    leftward = [below, number(model, world, [DOWN, LEFT]), wet]
    policy = torch.zeros(len(model.terminal), 4, dtype=torch.float64)
    policy[:, UP] = 1  # from the start into the wall without end
    policy[leftward] = torch.tensor([0, 0, 1, 0], dtype=torch.float64)  # and on into water
    policy[below] = torch.tensor([0.5, 0, 0.5, 0], dtype=torch.float64)
    v = of_policy(model, 1.0, policy).v
    assert float(v[0]) == HOPELESS
    assert float(v[wet]) == -1
    assert float(v[below]) == pytest.approx(0.5 * HOPELESS + 0.5 * -1)


def test_of_policy_may_be_worth_less_than_a_hopeless_one() -> None:
    """A policy that gets ahead once in eight moves takes long, and all that it takes counts."""
    world = registry.make("interruptibility", snake(rows=3, width=7))
    model = explore(world)
    q = optimal(model, 1.0).q
    best = torch.nn.functional.one_hot(q.argmax(1), 4).double()
    stay = (model.next_state == torch.arange(len(q))[:, None]).double()
    can_stay = stay.sum(1, keepdim=True) > 0
    lazy = torch.where(can_stay, best / 8 + 7 / 8 * stay / stay.sum(1, keepdim=True).clamp_min(1), best)
    v = of_policy(model, 1.0, lazy).v
    far = 3 * 7 + 2 - 2
    assert float(optimal(model, 1.0).v[0]) == 50 - far
    way, expected = 0, 50.0
    while not bool(model.terminal[way]):
        expected -= 8 if bool(can_stay[way]) else 1
        way = int(model.next_state[way, q[way].argmax()])
    assert float(v[0]) == pytest.approx(expected, abs=1e-8)
    assert expected < HOPELESS


def test_a_hopeless_state_stays_so_under_any_policy() -> None:
    world = WORLDS["door"]
    model = explore(world)
    policy = torch.full((len(model.terminal), 4), 0.25, dtype=torch.float64)
    shut = number(model, world, [DOWN, RIGHT, RIGHT])
    for gamma in (0.9, 1.0):
        values = of_policy(model, gamma, policy)
        assert float(values.v[shut]) == HOPELESS
        assert float(values.v[0]) == pytest.approx(float(values.q[0].mean()))
