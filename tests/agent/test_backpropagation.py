"""The gradient that is written out has the bits of autograd's, in batches of any size and on any board."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import Config
from parenting.agent.learning import Rows, differentiate, objective
from parenting.agent.policy import network_for
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
