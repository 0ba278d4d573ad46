"""Pre-training from scratch (Sec. 3.1.4): a step that leaves nothing half done, and the exam."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import pretraining_loop
from parenting.agent.adam import adam
from parenting.agent.policy import network_for
from parenting.agent.pretraining import policy_gradient
from parenting.agent.pretraining_loop import EvalResult, Pretrainer, TrainState
from parenting.agent.pretraining_mazes import ARRIVED, LIMIT, pool
from parenting.agent.state import Rehearsal
from parenting.envs.rng import keys
from reference.pretraining import MOVES, Maze
from reference.pretraining import pool as plain_pool

GLYPHS = "# GXA"
SIZE = (4, 5)


def small(seed: int = 3) -> Pretrainer:
    return Pretrainer(network_for(*SIZE, len(GLYPHS)), GLYPHS, seed)


def parts(train_state: TrainState) -> list[torch.Tensor]:
    return list(train_state.tensors().values())


def test_a_step_leaves_the_pupil_as_it_was() -> None:
    pretrainer = small()
    before = pretrainer.init()
    kept = before.clone()
    after = pretrainer.update(before)
    assert all(torch.equal(one, other) for one, other in zip(parts(before), parts(kept), strict=True))
    assert not torch.equal(after.params, before.params)
    assert (int(after.tick), int(after.moments.steps), len(after.returns)) == (1, 1, 1)


def test_an_interruption_within_a_step_loses_that_step_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    pretrainer = small()
    train_state = pretrainer.update(pretrainer.init())
    expected = pretrainer.update(train_state)

    def interrupted(live: torch.Tensor, moments: Rehearsal, *rest: object) -> None:
        adam(live, moments, *rest)  # type: ignore[arg-type]
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(pretraining_loop, "adam", interrupted)
        with pytest.raises(KeyboardInterrupt):
            pretrainer.update(train_state)
    again = pretrainer.update(train_state)
    assert all(torch.equal(one, other) for one, other in zip(parts(again), parts(expected), strict=True))


def test_seeds_are_different_schools_and_one_seed_is_the_same() -> None:
    first, same = small().update(small().init()), small().update(small().init())
    assert torch.equal(first.params, same.params)
    assert not torch.equal(small(seed=4).init().params, small().init().params)


@pytest.mark.slow
def test_an_exam_does_not_depend_on_how_many_mazes_it_looks_at_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pretrainer = small()
    weights = pretrainer.init().params[0]
    whole = pretrainer.evaluate(weights)
    monkeypatch.setattr(pretraining_loop, "CELLS", 1)  # one maze at a time
    assert pretrainer.evaluate(weights) == pytest.approx(whole, rel=1e-5)


def test_an_exam_by_a_plain_walk() -> None:
    """Its three figures, of mazes that are looked at one by one."""
    mazes = pool(*SIZE, GLYPHS)
    pretrainer, few = small(), mazes.size[:40]
    board, cell, near, then, first = (part[:40] for part in mazes[:5])
    pretrainer.outside = mazes._replace(
        board=board, cell=cell, local_state=near, next_state=then, first=first, size=few
    )
    weights = pretrainer.init().params[0]
    found = pretrainer.evaluate(weights)
    assert found == pytest.approx(plain_exam(weights, plain_pool(*SIZE, GLYPHS)[:40]), rel=1e-4)
    assert 0 < found.solved < 1


def plain_exam(weights: torch.Tensor, mazes: list[Maze]) -> EvalResult:
    every = [(maze, logits_in(weights, maze)) for maze in mazes]
    solved = sum(solves(maze, logits.argmax(1).tolist()) for maze, logits in every)
    chances = torch.cat([logits for _, logits in every]).softmax(1)
    best, second = chances.log().sort(dim=1, descending=True).values[:, :2].T
    entropy = -(chances * chances.log()).sum(1)
    return EvalResult(solved / len(mazes), float(entropy.mean()), float((best - second).mean()))


def logits_in(weights: torch.Tensor, maze: Maze) -> torch.Tensor:
    boards = [maze.seen(cell, GLYPHS.index("A")) for cell in maze.cells]
    near = [[maze.ground[y + dy][x + dx] for dy, dx in MOVES] for y, x in maze.cells]
    codes = (torch.tensor(part, dtype=torch.uint8) for part in (boards, near))
    return network_for(*SIZE, len(GLYPHS)).logits(weights.repeat(len(boards), 1), *codes).double()


def solves(maze: Maze, actions: list[int]) -> bool:
    best, cell = dict(zip(maze.cells, actions, strict=True)), maze.start
    for _ in range(LIMIT):
        cell = maze.after(cell, best[cell])
        if cell == maze.goal:
            return True
    return False


def test_convergence_wants_level_returns_and_solved_mazes(monkeypatch: pytest.MonkeyPatch) -> None:
    pretrainer = small()
    train_state = pretrainer.init()
    solved = 0.9

    def examine(_school: Pretrainer, _weights: torch.Tensor) -> EvalResult:
        return EvalResult(solved, 0.5, 1.0)

    monkeypatch.setattr(Pretrainer, "evaluate", examine)

    def converged(before: float, last: float, steps: int = 600) -> bool:
        half = torch.full((300,), before)
        returns = torch.cat((torch.zeros(steps - 600), half, torch.full((300,), last)))[-steps:]
        return pretrainer.converged(train_state.replace(returns=returns))

    assert not converged(40, 40)  # 90 % are too few
    solved = 0.95
    assert converged(40, 40)
    assert converged(40, 40.4)
    assert not converged(40, 40.6)
    assert not converged(40, 40, steps=625)  # looked at every 50 steps
    assert converged(40, 40, steps=650)
    assert not pretrainer.converged(train_state.replace(returns=torch.full((550,), 40.0)))


def test_a_step_makes_the_better_move_likelier() -> None:
    """In 3 x 4 cells each maze is one move: to the right or to the left."""
    network, mazes = network_for(3, 4, len(GLYPHS)), pool(3, 4, GLYPHS)
    key = keys(0, 1)
    live = network.init_params(key, torch.float64)
    found, _ = policy_gradient(network, live, mazes, key)

    def good(parameters: torch.Tensor) -> torch.Tensor:
        logits = network.logits(parameters.expand(2, -1), *first_two())
        right = mazes.next_state[[one, two], 0] == ARRIVED
        return logits.softmax(1)[right]

    one = 0
    two = int((mazes.cell[:, 0] != mazes.cell[0, 0]).nonzero()[0])

    def first_two() -> tuple[torch.Tensor, torch.Tensor]:
        maze, state = torch.tensor([one, two]), torch.tensor([0, 0])
        return mazes.observation(maze, state), mazes.local_state[maze, state]

    assert bool((good(live - 0.05 * found) > good(live)).all())
