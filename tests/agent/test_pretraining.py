"""Pre-training (Sec. 3.1.4): mazes as tables, episodes, the gradient, and who owes a step."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import parenting, pretraining
from parenting.agent.config import PRESETS, Config
from parenting.agent.init import network_of
from parenting.agent.policy import network_for
from parenting.agent.pretraining import policy_gradient, returns_to_go, visited
from parenting.agent.pretraining_loop import Pretrainer
from parenting.agent.pretraining_mazes import ARRIVED, EPISODES, LIMIT, Batch, draw_mazes, outside, pool, walk
from parenting.agent.query import silence
from parenting.envs import registry
from parenting.envs.levels.rules import MOVES
from parenting.envs.rng import keys

GLYPHS = "# GXA"
SIZES = [(3, 4), (4, 4), (6, 6), (6, 8)]


@pytest.mark.parametrize("size", SIZES)
def test_tables_are_the_mazes(size: tuple[int, int]) -> None:
    """Every action in every state of the first mazes leads where a look at the board says."""
    height, width = size
    mazes = pool(height, width, GLYPHS)
    for maze in range(25):
        board = mazes.board[maze].flatten().tolist()
        cells = mazes.cell[maze, : mazes.size[maze]].tolist()
        assert cells == [cell for cell, code in enumerate(board) if code == 1]  # land, row by row
        for state, cell in enumerate(cells):
            for action, (row, column) in enumerate(MOVES):
                to = cell + row * width + column
                to = cell if board[to] == 0 else to
                expected = ARRIVED if board[to] == GLYPHS.index("G") else cells.index(to)
                assert int(mazes.next_state[maze, state, action]) == expected
                assert int(mazes.local_state[maze, state, action]) == board[cell + row * width + column]


@pytest.mark.parametrize("size", SIZES)
def test_mazes_outside_the_pool_are_not_in_it(size: tuple[int, int]) -> None:
    known, fresh = pool(*size, GLYPHS), outside(*size, GLYPHS)
    words = {(bytes(b.flatten().tolist()), int(f)) for b, f in zip(known.board, known.first, strict=True)}
    found = {(bytes(b.flatten().tolist()), int(f)) for b, f in zip(fresh.board, fresh.first, strict=True)}
    if size in ((3, 4), (4, 4)):  # so few mazes that the pool has them all
        assert torch.equal(fresh.board, known.board)
    else:
        assert not words & found


def corridor() -> Batch:
    """One maze for each episode: three states in a row, the goal behind the third."""
    then = torch.tensor([[0, 0, 0, 1], [1, 1, 0, 2], [2, 2, 1, 3], [3, 3, 3, 3]])[None]
    return Batch(
        observation=torch.zeros(1, 3, 1, 1, dtype=torch.uint8),
        local_state=torch.zeros(1, 3, 4, dtype=torch.uint8),
        next_state=then,
        first=torch.zeros(1, EPISODES, dtype=torch.int64),
    )


def test_returns_of_a_straight_walk_by_hand() -> None:
    right = torch.zeros(1, 3, 4, dtype=torch.float64)
    right[..., 3] = 1
    walks = walk(corridor(), right, keys(0, 1))
    assert bool(walks.arrived.all())
    assert returns_to_go(walks)[0, :3, 0].tolist() == [47, 48, 49]
    assert walks.alive.sum((1, 2)).tolist() == [3 * EPISODES]


def test_an_episode_that_is_cut_off_earns_its_steps_alone() -> None:
    up = torch.zeros(1, 3, 4, dtype=torch.float64)
    up[..., 0] = 1
    walks = walk(corridor(), up, keys(0, 1))
    assert not bool(walks.arrived.any())
    earned = returns_to_go(walks)[0, :, 0]
    assert earned.tolist() == [float(t - LIMIT) for t in range(LIMIT)]


def test_the_gradient_is_that_of_every_single_step() -> None:
    """Summed over distinct states, it is REINFORCE over all steps, one by one."""
    network, mazes, key = network_for(4, 4, len(GLYPHS)), pool(4, 4, GLYPHS), keys(5, 3)
    start = network.init_params(key, torch.float64)
    found, mean = policy_gradient(network, start, mazes, key)
    for trial in range(3):
        mine = key.pick(torch.tensor([trial]))
        expected, earned = plainly(start[trial : trial + 1], mine)
        torch.testing.assert_close(found[trial], expected, rtol=1e-9, atol=1e-12)
        assert float(mean[trial]) == pytest.approx(earned)


def test_a_gradient_does_not_depend_on_the_trials_beside_it() -> None:
    network, mazes, key = network_for(4, 6, len(GLYPHS)), pool(4, 6, GLYPHS), keys(8, 5)
    start = network.init_params(key, torch.float64)
    together, earned = policy_gradient(network, start, mazes, key)
    for trial in range(5):
        mine = torch.tensor([trial])
        alone, mean = policy_gradient(network, start[mine], mazes, key.pick(mine))
        torch.testing.assert_close(together[trial], alone[0], rtol=1e-9, atol=1e-12)
        assert float(mean) == float(earned[trial])


def plainly(start: torch.Tensor, key: object) -> tuple[torch.Tensor, float]:
    network, mazes = network_for(4, 4, len(GLYPHS)), pool(4, 4, GLYPHS)
    batch = draw_mazes(mazes, key)  # type: ignore[arg-type]
    live = start.clone().requires_grad_()
    logs = network.heads(network.unpack(live), batch.observation, batch.local_state).logits.log_softmax(2)[0]
    walks = walk(batch, logs.exp().detach()[None].double(), key)  # type: ignore[arg-type]
    steps = []
    for e in range(EPISODES):
        length = int(walks.alive[0, :, e].sum())
        bonus = 50.0 if bool(walks.arrived[0, e]) else 0.0
        for t in range(length):
            where, action = int(walks.state[0, t, e]), int(walks.action[0, t, e])
            steps.append((where, action, bonus - (length - t), t))
    worth = torch.tensor([step[2] for step in steps], dtype=torch.float64)
    worth = (worth - worth.mean()) / worth.std(unbiased=False)
    loss = torch.zeros((), dtype=torch.float64)
    for (where, action, _, _), value in zip(steps, worth, strict=True):
        chances = logs[where].exp()
        entropy = -(chances * logs[where]).sum()
        loss = loss - (value * logs[where, action] + pretraining.ENTROPY * entropy) / len(steps)
    loss.backward()  # type: ignore[no-untyped-call]
    assert live.grad is not None
    first = [step[2] for step in steps if step[3] == 0]
    return live.grad[0], sum(first) / len(first)


def test_visits_count_every_step_once() -> None:
    network, key = network_for(4, 4, len(GLYPHS)), keys(1, 4)
    batch = draw_mazes(pool(4, 4, GLYPHS), key)
    logits = network.heads(
        network.unpack(network.init_params(key, torch.float64)), batch.observation, batch.local_state
    ).logits
    walks = walk(batch, logits.softmax(2), key)
    visits = visited(batch, walks, returns_to_go(walks), torch.float64)
    torch.testing.assert_close(visits.share.sum(1), torch.ones(4, dtype=torch.float64))
    torch.testing.assert_close(
        visits.worth.sum((1, 2)), torch.zeros(4, dtype=torch.float64), atol=1e-9, rtol=0
    )


def test_only_who_trained_owes_and_only_who_owes_moves() -> None:
    """A tick's training is paid for at the end of the next tick, whether or not that one trains."""
    world = registry.make("side-effects")
    config = Config.model_validate({**PRESETS["lax"], "pretrain": True})
    key = keys(2, 8)
    state = parenting.init(world, config, key, network_of(world).init_params(key, torch.float32)[0])
    owed = torch.tensor([True, False] * 4)
    trained = torch.tensor([False] * 4 + [True] * 4)
    state = state.replace(
        rehearsal=state.rehearsal.replace(owed=owed), info=state.info.replace(trained=trained)
    )
    before = state.clone()
    after = parenting.rehearse(world, config, state)
    moved = (after.learner.params != before.learner.params).any(1)
    assert torch.equal(moved, owed)
    assert torch.equal(after.rehearsal.owed, trained)
    assert torch.equal(after.rehearsal.steps, owed.long())
    changed = {
        "learner.params",
        "rehearsal.exp_avg",
        "rehearsal.exp_avg_sq",
        "rehearsal.steps",
        "rehearsal.owed",
    }
    theirs = before.tensors()
    assert {n for n, part in after.tensors().items() if not torch.equal(part, theirs[n])} == changed


def test_without_pre_training_nothing_is_kept_or_done() -> None:
    world, config = registry.make("side-effects"), Config()
    state = parenting.init(world, config, keys(0, 2))
    assert state.rehearsal.exp_avg.numel() == 0
    assert parenting.rehearse(world, config, state) is state
    state, _ = parenting.step(world, config, state, silence(parenting.no_query(world, config, state)))
    assert not bool(state.rehearsal.owed.any())


def test_weights_come_where_they_are_wanted() -> None:
    world = registry.make("side-effects")
    with pytest.raises(ValueError, match="pre-trained weights"):
        parenting.init(world, Config(pretrain=True), keys(0, 1), None)
    with pytest.raises(ValueError, match=r"must hold \d+ numbers"):
        parenting.init(world, Config(pretrain=True), keys(0, 1), torch.zeros(3))


@pytest.mark.slow
def test_school_teaches_a_small_size_until_it_has_converged() -> None:
    pretrainer = Pretrainer(network_for(4, 4, len(GLYPHS)), GLYPHS)
    train_state = pretrainer.init()
    fresh = pretrainer.evaluate(train_state.params[0])
    while not pretrainer.converged(train_state) and len(train_state.returns) < 3000:
        train_state = pretrainer.update(train_state)
    learnt = pretrainer.evaluate(train_state.params[0])
    assert pretrainer.converged(train_state)
    assert learnt.solved >= 0.95 > fresh.solved
    assert float(train_state.returns[-100:].mean()) > float(train_state.returns[:100].mean()) + 2
