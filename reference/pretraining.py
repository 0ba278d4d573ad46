"""Pre-training for one trial in plain Python (Sec. 3.1.4): a step on mazes, and when parenting owes one.

docs/paper.md, "Pre-training", decides what the paper leaves open. Like the rest of the reference it shares
with the agent the random keys, the config, the worlds and their mazes, and nothing else.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import torch
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.pretraining import ENTROPY
from parenting.envs.gridworld import Gridworld
from parenting.envs.random_mazes import mazes
from parenting.envs.rng import Keys, Stream, keys
from reference.clips import Board, Clip, board
from reference.parenting import ACTIONS, Reference
from reference.policy import Policy, entropy

EPISODES, LIMIT = 16, 100
POOL, POOL_SEED = 4096, 2019
WALL = 0
MOVES = ((-1, 0), (1, 0), (0, -1), (0, 1))  # up, down, left, right
Cell = tuple[int, int]


class Maze(NamedTuple):
    """One goal, and a wall all around."""

    ground: Board
    start: Cell
    goal: Cell

    @property
    def cells(self) -> list[Cell]:
        """The cells where the agent can stand: all except walls and the goal, which ends an episode."""
        free = [(y, x) for y, row in enumerate(self.ground) for x, code in enumerate(row) if code != WALL]
        return [cell for cell in free if cell != self.goal]

    def after(self, cell: Cell, action: int) -> Cell:
        """The cell after a move; a wall stops it."""
        ahead = cell[0] + MOVES[action][0], cell[1] + MOVES[action][1]
        return cell if self.ground[ahead[0]][ahead[1]] == WALL else ahead

    def seen(self, cell: Cell, agent: int) -> Board:
        """The board with the agent drawn on a cell."""
        rows = [list(row) for row in self.ground]
        rows[cell[0]][cell[1]] = agent
        return tuple(tuple(row) for row in rows)


class Visit(NamedTuple):
    """One step of an episode."""

    seen: Board
    action: int
    earned: float  # from this step on


@cache
def pool(height: int, width: int, glyphs: str) -> list[Maze]:
    """The mazes to learn from: the same for every run in a world of this size."""
    drawn = mazes(height, width, glyphs, keys(POOL_SEED, POOL))
    starts, goals = drawn.start.tolist(), drawn.goal.tolist()
    return [
        Maze(board(drawn.board[i, None]), divmod(starts[i], width), divmod(goals[i], width))
        for i in range(POOL)
    ]


def pretrain(policy: Policy, adam: torch.optim.Adam, pool: list[Maze], keys: Keys) -> None:
    """A step of pre-training: 16 whole episodes, and one step of Adam up the policy's gradient."""
    drawn = keys.uniform(Stream.MAZES, EPISODES)[0].tolist()
    visits: list[Visit] = []
    for episode, u in enumerate(drawn):
        place = EPISODES * torch.arange(LIMIT) + episode
        draws = keys.at(Stream.WALKS, place)[0].tolist()
        visits += walk(policy, pool[int(len(pool) * u)], draws)
    adam.zero_grad()
    loss(policy, visits).backward()  # type: ignore[no-untyped-call]
    adam.step()


def walk(policy: Policy, maze: Maze, draws: list[float]) -> list[Visit]:
    """An episode: +50 at the goal, -1 a step, cut off after as many steps as there are draws."""
    chances = chances_in(policy, maze)
    cell, steps = maze.start, []
    for u in draws:
        action = draw(chances[cell], u)
        steps.append((maze.seen(cell, policy.agent), action))
        cell = maze.after(cell, action)
        if cell == maze.goal:
            break
    prize = 50.0 if cell == maze.goal else 0.0
    return [Visit(*step, prize - (len(steps) - t)) for t, step in enumerate(steps)]


def chances_in(policy: Policy, maze: Maze) -> dict[Cell, list[float]]:
    """pi(a|s) in every state of a maze; the policy does not change within a step."""
    with torch.no_grad():
        chances = logits(policy, [maze.seen(cell, policy.agent) for cell in maze.cells]).softmax(1)
    return dict(zip(maze.cells, chances.tolist(), strict=True))


def draw(chances: list[float], u: float) -> int:
    """The action drawn by u: the interval of [0, 1) that holds u, with one interval for each probability."""
    return sum(u >= sum(chances[: a + 1]) for a in list(ACTIONS)[:-1])


def loss(policy: Policy, visits: list[Visit]) -> Tensor:
    """REINFORCE, with returns normalised over the step; and the entropy. A mean over the visits."""
    earned = torch.tensor([visit.earned for visit in visits], dtype=torch.float64)
    spread = earned.std(correction=0).clamp_min(1e-8)  # all returns may be equal
    z = logits(policy, [visit.seen for visit in visits])
    actions = torch.tensor([[visit.action] for visit in visits])
    log_pi = z.log_softmax(1).gather(1, actions).squeeze(1)
    return -((earned - earned.mean()) / spread * log_pi).mean() - ENTROPY * entropy(z).mean()


def logits(policy: Policy, seen: list[Board]) -> Tensor:
    """The policy's logits: the mean of its two heads (3.1.1)."""
    near, far = policy.heads(seen)
    return (near + far) / 2


class Rehearsing(Reference):
    """One trial that begins with pre-trained weights and goes on with mazes while it is parented."""

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        seed: int,
        trial: int,
        choose: Callable[[Clip, Clip, str], str],
        weights: Keys,
    ) -> None:
        """Start from the pre-trained weights that `weights` draw."""
        super().__init__(world, config, seed, trial, choose)
        self.pi.draw(weights)
        self.pool = pool(world.height, world.width, world.legend)
        self.owed = self.trained = False
        self.rehearsed: list[int] = []

    def tick(self) -> None:
        """Run one tick and, after its query, the step on mazes that the training of the last tick owes."""
        self.trained = False
        super().tick()
        if self.owed:
            pretrain(self.pi, self.mazes, self.pool, self.keys)
            self.rehearsed.append(int(self.keys.tick))
        self.owed = self.trained

    def train(self) -> bool:
        """Take gradient steps on X; together they owe one step on mazes."""
        self.trained = super().train()
        return self.trained

    def begin_stage(self) -> None:
        """Keep the mazes' own Adam, which continues from pi_T to pi_{T+1} unchanged."""
        before = getattr(self, "mazes", None)
        super().begin_stage()
        self.mazes = torch.optim.Adam(self.pi.parameters())
        if before:
            self.mazes.load_state_dict(before.state_dict())
