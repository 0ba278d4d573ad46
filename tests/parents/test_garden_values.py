"""The parent in the garden (Sec. 3.2.2, 3.3): its way, what it waters, and its values in closed form."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.query import QueryKind
from parenting.envs import registry
from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.parents.garden_values import GardenValues
from tests.parents.walked_queries import begun, garden, query, walked

UP, DOWN, LEFT, RIGHT = range(4)
GAMMA = 0.9
FIG_2: list[tuple[str, GardenParent, float]] = [
    ("garden", "up-down", 4.48),
    ("garden-mirrored", "up-down", 2.97),
    ("garden", "left", 2.73),
]
"""Mean waterings in the 10 steps of Sec. 3.3, measured with another program."""


def arrows(world: RewardHacking, policy: Tensor) -> list[str]:
    """pi_p drawn: u, d, l, r, and # where nobody comes."""
    drawn = "".join("udlr#"[action] for action in policy.tolist())
    return [drawn[row * world.width : (row + 1) * world.width] for row in range(world.height)]


# pi_p


def test_the_way_of_the_parent() -> None:
    """Clockwise around; inside up above the middle and down below it; out of the bucket down."""
    world = garden()
    expected = ["#########", "#######d#", "#rrrrrrd#", "#uuuuuud#", "#udddddd#", "#ullllll#", "#########"]
    assert arrows(world, GardenValues(world, GAMMA).policy[0]) == expected
    leftward = ["#########", "#######d#", "#rrrrrrd#", "#ullllld#", "#ullllld#", "#ullllll#", "#########"]
    assert arrows(world, GardenValues(world, GAMMA, "left").policy[0]) == leftward


def test_a_way_to_the_cycle_keeps_clear_of_the_bucket() -> None:
    """The shortest way leads through it, and so does the way left."""
    text = "cycle: 2,2 r d l u\n\n########\n#TtO  A#\n#  #   #\n#      #\n########\n"
    expected = ["########", "#rdlddd#", "#ul#ddd#", "#uullll#", "########"]
    for inside in ("up-down", "left"):
        world = garden(text)
        assert arrows(world, GardenValues(world, GAMMA, inside).policy[0]) == expected


@pytest.mark.parametrize(("level", "inside", "mean"), FIG_2)
def test_mean_waterings_in_ten_steps(level: str, inside: GardenParent, mean: float) -> None:
    found = float(GardenValues(garden(level), GAMMA, inside).waterings(10))
    assert found == pytest.approx(mean, abs=0.006)


@pytest.mark.parametrize("steps", [10, 60])
@pytest.mark.parametrize(("level", "inside", "_mean"), FIG_2)
def test_mean_waterings_against_the_world(level: str, inside: GardenParent, _mean: float, steps: int) -> None:
    world = garden(level)
    parent = GardenValues(world, GAMMA, inside)
    start = world.reset(keys(1, 4000), torch.zeros(4000, dtype=torch.int64))
    earned = torch.stack(list(rewards(world, parent, start, steps))).sum(0)
    assert float(parent.waterings(steps)) == pytest.approx(float(earned.mean()), abs=4 * error(earned))


def rewards(
    world: RewardHacking, parent: GardenValues, state: WorldState, steps: int, first: Tensor | None = None
) -> list[Tensor]:
    """The world's own reward in each step, by pi_p or first by another action."""
    key, earned = keys(7, len(state.step_count)), []
    for number in range(steps):
        cell = state.agent[:, 0] * world.width + state.agent[:, 1]
        action = parent.policy[state.level, cell] if number or first is None else first
        key = key.next()
        after = world.step(state, action, key)
        earned.append(world.reward(state, action, after))
        state = after
    return earned


def error(sample: Tensor) -> float:
    return float(sample.std() / len(sample) ** 0.5)


# Values


STATES: dict[str, tuple[str, list[int]]] = {
    "start": ("garden", []),
    "on a plant that was dry": ("garden", [UP, RIGHT]),
    "on a watered plant": ("garden", [UP, LEFT, LEFT]),
    "in the bucket": ("garden", [RIGHT] * 4 + [UP, UP, UP]),
    "above the lower plants": ("garden-mirrored", [DOWN]),
    "in the mirrored bucket": ("garden-mirrored", [LEFT] * 4 + [UP, UP, UP]),
}


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_against_long_roll_outs(state: str) -> None:
    """Each Q_p(s, a) by 1500 walks of 100 steps through the real world: 0.9 ** 100 is less than 0.0001."""
    level, moves = STATES[state]
    world, many = garden(level), 1500
    parent, now = GardenValues(world, GAMMA), walked(world, begun(world), moves, seed=3)[-1]
    assert not moves or ("bucket" in state) == bool(world.tile(now.board, now.agent) == world.code("O"))
    every = now.pick(torch.zeros(4 * many, dtype=torch.int64))
    action = torch.arange(4).repeat_interleave(many)
    earned = torch.zeros(4 * many, dtype=torch.float64)
    for t, reward in enumerate(rewards(world, parent, every, 100, action)):
        earned += GAMMA**t * reward
    q = parent.q(*placed(now.pick(torch.zeros(4, dtype=torch.int64))), torch.arange(4))
    for number, sample in enumerate(earned.view(4, many)):
        assert float(q[number]) == pytest.approx(float(sample.mean()), abs=4.5 * error(sample) + 1e-3)
    own = parent.policy[0, int(now.agent[0, 0]) * world.width + int(now.agent[0, 1])]
    assert float(parent.v(*placed(now))) == pytest.approx(float(q[own]), abs=1e-9)


def placed(state: WorldState) -> tuple[Tensor, Tensor, Tensor]:
    return state.board, state.agent, state.level


RING = "cycle: 2,2 rr dd ll uu\n\n#####\n#tA #\n#TOt#\n# T #\n#####\n"
"""Nine cells: the bucket in the middle, and around it the parent's way."""
TAIL = "cycle: 2,5 r d l u\n\n#######\n#OtT t#\n####A #\n#######\n"
"""A way of four cells, and one that leads to it over two plants, which pi_p passes once."""

WAYS = {
    RING: {(1, 1): RIGHT, (1, 2): RIGHT, (1, 3): DOWN, (2, 3): DOWN, (3, 3): LEFT, (3, 2): LEFT}
    | {(3, 1): UP, (2, 1): UP, (2, 2): UP},
    TAIL: {(1, 1): RIGHT, (1, 2): RIGHT, (1, 3): RIGHT, (1, 4): RIGHT, (1, 5): DOWN, (2, 5): LEFT}
    | {(2, 4): UP},
}
"""pi_p by hand."""

Cell = tuple[int, int]
Plants = tuple[bool, ...]


class ScalarValueIteration:
    """Plain value iteration over all (cell, which plants are dry): every way that drying can go is summed."""

    def __init__(self, text: str, drying: float, gamma: float = GAMMA, sweeps: int = 160) -> None:
        self.rows, self.drying, self.gamma = text.split("\n\n")[1].splitlines(), drying, gamma
        cells = [(y, x) for y, row in enumerate(self.rows) for x in range(len(row))]
        self.plants = [cell for cell in cells if self.rows[cell[0]][cell[1]] in "Tt"]
        free = [cell for cell in cells if self.rows[cell[0]][cell[1]] != "#"]
        dryness = [
            tuple(n >> i & 1 == 1 for i in range(len(self.plants))) for n in range(2 ** len(self.plants))
        ]
        self.ways = {(c, d, a): self.way(c, d, a) for c in free for d in dryness for a in range(4)}
        self.v = {(c, d): 0.0 for c in free for d in dryness}
        for _ in range(sweeps):
            self.v = {(c, d): self.q(c, d, WAYS[text][c]) for c, d in self.v}

    def q(self, cell: Cell, dry: Plants, action: int) -> float:
        earned, then = self.ways[cell, dry, action]
        return earned + self.gamma * sum(chance * self.v[state] for chance, state in then)

    def way(
        self, cell: Cell, dry: Plants, action: int
    ) -> tuple[int, list[tuple[float, tuple[Cell, Plants]]]]:
        """Move, water, dry: the reward, and every state that may follow with its chance."""
        y, x = ((-1, 0), (1, 0), (0, -1), (0, 1))[action]
        ahead = (cell[0] + y, cell[1] + x)
        to = cell if self.rows[ahead[0]][ahead[1]] == "#" else ahead
        earned = sum(1 for plant, parched in zip(self.plants, dry, strict=True) if parched and plant == to)
        then: list[tuple[float, Plants]] = [(1.0, ())]
        for plant, parched in zip(self.plants, dry, strict=True):
            chance = 1.0 if parched and plant != to else self.drying
            then = [
                (p * share, (*so_far, dries))
                for p, so_far in then
                for share, dries in ((chance, True), (1 - chance, False))
                if share
            ]
        return earned, [(p, (to, plants)) for p, plants in then]

    def seen(self, state: WorldState, world: RewardHacking) -> tuple[Cell, Plants]:
        """Where a state of the world stands among ours."""
        (y, x), board = state.agent[0].tolist(), state.board[0]
        return (y, x), tuple(int(board[plant]) == world.code("t") for plant in self.plants)


@pytest.mark.parametrize("drying", [0.0, 0.05, 0.3, 1.0])
@pytest.mark.parametrize("text", [RING, TAIL])
def test_against_plain_value_iteration(text: str, drying: float) -> None:
    """V_p and Q_p of every cell and every set of dry plants."""
    world, plain = garden(text, drying), ScalarValueIteration(text, drying)
    parent = GardenValues(world, GAMMA)
    cells, dryness = [c for c, _ in plain.v], [d for _, d in plain.v]
    board = world.beginnings().board.repeat(len(cells), 1, 1)
    for number, (y, x) in enumerate(plain.plants):
        dry = torch.tensor([plants[number] for plants in dryness])
        board[:, y, x] = torch.where(dry, world.code("t"), world.code("T")).to(torch.uint8)
    agent, level = torch.tensor(cells), torch.zeros(len(cells), dtype=torch.int64)
    assert parent.v(board, agent, level).tolist() == pytest.approx(list(plain.v.values()), abs=1e-6)
    for action in range(4):
        expected = [plain.q(cell, dry, action) for cell, dry in plain.v]
        found = parent.q(board, agent, level, torch.full_like(level, action))
        assert found.tolist() == pytest.approx(expected, abs=1e-6)
    assert max(plain.v.values()) > 0.4


@pytest.mark.parametrize("drying", [0.05, 0.5])
@pytest.mark.parametrize("text", [RING, TAIL])
def test_advantage_of_random_clips(text: str, drying: float) -> None:
    """Eq. (7) by plain value iteration on the states that the clips came to, dried plants and all."""
    world, plain, rng = (
        garden(text, drying),
        ScalarValueIteration(text, drying),
        torch.Generator().manual_seed(2),
    )
    parent = GardenValues(world, GAMMA)
    for number in range(25):
        draws = torch.randint(4, (3, 6), generator=rng).tolist()
        start = walked(world, begun(world), draws[0], seed=number)[-1]
        left, right = draws[1][: 1 + number % 6], draws[2][: 1 + number % 4]
        asked = query(world, QueryKind.PREFERENCE, start, left, right, seed=number)
        expected = []
        for side, moves in enumerate((left, right)):
            states = [plain.seen(s, world) for s in walked(world, start, moves, number + side)]
            gains = [plain.q(*s, a) - plain.v[s] for s, a in zip(states, moves, strict=False)]
            expected.append(sum(GAMMA**t * gain for t, gain in enumerate(gains)))
        assert parent.alpha(asked)[0].tolist() == pytest.approx(expected, abs=1e-5)


def test_levels_of_one_batch_do_not_mix() -> None:
    names = ("garden", "garden-mirrored")
    both = registry.make("reward-hacking", [registry.level("reward-hacking", name) for name in names])
    assert isinstance(both, RewardHacking)
    together, start = GardenValues(both, GAMMA), both.beginnings()
    alone = [GardenValues(garden(name), GAMMA) for name in names]
    assert torch.equal(together.policy, torch.cat([one.policy for one in alone]))
    for number, (name, one) in enumerate(zip(names, alone, strict=True)):
        own = garden(name).beginnings()
        v = float(one.v(*placed(own)))
        assert float(together.v(*placed(start))[number]) == pytest.approx(v, abs=1e-12)
        assert float(together.waterings(10)[number]) == pytest.approx(float(one.waterings(10)), abs=1e-12)
