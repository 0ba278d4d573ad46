"""The gradient that is written out has the bits of autograd's, in batches of any size and on any board."""

from __future__ import annotations

import pytest
import torch

from parenting.agent import dataset, learning, parenting
from parenting.agent.adam import adam
from parenting.agent.config import Config
from parenting.agent.init import network_of, world_of
from parenting.agent.learning import Rows, choose, differentiate, objective
from parenting.agent.policy import network_for
from parenting.agent.state import AgentState
from parenting.agent.untracked import untracked
from parenting.envs.rng import keys

CONFIG = Config(lambda_global=0.03, lambda_local=0.007)


def rows(height: int, width: int, codes: int, trials: int, states: int, count: int) -> Rows:
    """Rows drawn at random: several a state, ties, and places beyond a trial's last row."""
    draws = torch.Generator().manual_seed(height + trials + states)

    def some(most: int, *shape: int) -> torch.Tensor:
        return torch.randint(most, (trials, *shape), generator=draws)

    left = some(4, count)
    mu = torch.tensor([[0.0, 0], [1, 0], [0, 2], [0.5, 0.5]], dtype=torch.float64)[some(4, count)]
    mu[:, 0] = torch.tensor([1.0, 0.0])
    return Rows(
        s0=some(codes, states, height, width).to(torch.uint8),
        local_state=some(codes, states, 4).to(torch.uint8),
        state_index=some(states, count),
        a0=torch.stack((left, (left + 1 + some(3, count)) % 4), -1),
        mu=mu,
    )


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(("trials", "states", "count"), [(1, 1, 1), (1, 9, 70), (3, 17, 40)])
@pytest.mark.parametrize(("height", "width"), [(6, 8), (7, 3), (2, 2), (1, 5)])
def test_gradient_has_the_bits_of_autograd(
    height: int, width: int, trials: int, states: int, count: int, dtype: str
) -> None:
    network = network_for(height, width, 5)
    parameters = network.init_params(keys(3, trials), getattr(torch, dtype))
    chosen = rows(height, width, 5, trials, states, count)
    layers = network.leaf_params(parameters)
    terms = objective(network.heads(layers, chosen.s0, chosen.local_state), chosen)
    value = (
        terms.loss - CONFIG.lambda_global * terms.entropy_global - CONFIG.lambda_local * terms.entropy_local
    )
    expected = network.gradient(value, layers)
    told, found = differentiate(network, CONFIG, parameters, chosen)
    assert found.abs().max() > 0
    assert found.numpy().tobytes() == expected.numpy().tobytes()
    assert all(torch.equal(one, other) for one, other in zip(told, terms, strict=True))


def taught(config: Config) -> AgentState:
    """Three agents at tick 0 whose X holds twelve entries, and one more of the first alone."""
    world = world_of("unsafe-exploration", "island", config)
    state, draws = parenting.init(world, config, keys(4, 3)), torch.Generator().manual_seed(2)
    for number in range(13):
        first = torch.randint(4, (3,), generator=draws)
        entry = dataset.Entry(
            s0=torch.randint(4, (3, world.height, world.width), generator=draws).to(torch.uint8),
            local_state=torch.randint(4, (3, 4), generator=draws).to(torch.uint8),
            a0=torch.stack((first, (first + 1 + number % 3) % 4), 1),
            mu=torch.tensor([[1.0, 0.0]], dtype=torch.float64).expand(3, 2),
        )
        told = torch.tensor([True, number < 12, number < 12])
        state = state.replace(x=dataset.add(state.x, entry, told, told))
    return state


@pytest.mark.parametrize("batch_size", [None, 12, 5])
@pytest.mark.parametrize("training", [[True, True, True], [True, False, True]])
def test_steps_of_one_tick_have_the_bits_of_single_steps(
    training: list[bool], batch_size: int | None
) -> None:
    config = Config(batch_size=batch_size, learning_rate=0.01, gradient_steps=4)
    network, chosen = network_of(world_of("unsafe-exploration", "island", config)), torch.tensor(training)
    together, apart = taught(config), taught(config)
    trial = chosen.nonzero().squeeze(1)
    terms, _ = learning.descend(network, config, together, chosen, range(4))
    for step in range(4):
        some = choose(config, apart.x, apart.keys, step).of(trial)
        told, gradient = differentiate(network, config, apart.learner.params[trial], some)
        adam(apart.learner.params, apart.learner, gradient, chosen, config.learning_rate)
    for name, tensor in together.learner.tensors().items():
        assert tensor.numpy().tobytes() == apart.learner.tensors()[name].numpy().tobytes(), name
    assert all(torch.equal(one, other) for one, other in zip(terms, told, strict=True))
    assert together.learner.steps.tolist() == [4 * each for each in training]


def test_untracked_operations_have_no_gradient_and_their_results_can_be_trained() -> None:
    weight = torch.ones(3, requires_grad=True)
    with untracked():
        found = 2 * weight
    assert not found.requires_grad
    found.requires_grad_().sum().backward()  # type: ignore[no-untyped-call]
    assert found.grad is not None
    assert found.grad.tolist() == [1, 1, 1]
    assert (2 * weight).requires_grad
