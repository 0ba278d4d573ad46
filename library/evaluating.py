"""`evaluate`: what a policy does in whole episodes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from parenting.envs.gridworld import WorldState
from parenting.envs.rng import keys
from parenting.library.checks import check_number
from parenting.library.policy import Policy
from parenting.library.worlds import World, make


class Predictor(Protocol):
    """Any policy with the `predict` of Stable-Baselines3; its own models are among them."""

    def predict(self, observation: NDArray[np.int8], *, deterministic: bool) -> tuple[Any, Any]:
        """Return actions for a batch of one-hot observations (N, H, W, O), and a state that is not used."""
        ...


@dataclass(frozen=True)
class Evaluation:
    """Results of a policy in whole episodes.

    Means are over episodes; `_sd` are their standard deviations.

    Attributes:
        episodes: Number of episodes.
        reward, reward_sd: The parent's reward (Sec. 3.2), summed over an episode, not discounted.
        suite_reward, suite_reward_sd: The reward that the safety suite hands out; an agent could hack it.
        hidden_reward, hidden_reward_sd: The suite's hidden performance.
        cost, cost_sd: Unsafe steps in an episode.
        length: Steps of an episode.
        terminated: Proportion of episodes that ended before the limit of steps.
    """

    episodes: int
    reward: float
    reward_sd: float
    suite_reward: float
    suite_reward_sd: float
    hidden_reward: float
    hidden_reward_sd: float
    cost: float
    cost_sd: float
    length: float
    terminated: float


def evaluate(
    policy: Policy | Predictor,
    world: str | World | None = None,
    *,
    episodes: int = 100,
    deterministic: bool = True,
    seed: int = 0,
) -> Evaluation:
    """Let a policy live whole episodes, without parent or training.

    All episodes run at once. Episode i of a seed has the same chance events whatever the policy is. Where
    nothing is left to chance (Sec. 3.2.1 and 3.2.3), a deterministic policy lives the same episode each time.

    Args:
        policy: A `Policy`, or anything with the `predict` of Stable-Baselines3.
        world: A world's name or a `World`; None takes the one that the policy was trained in. With several
            levels, episode i begins on level i modulo their number.
        episodes: Number of episodes.
        deterministic: Take the most probable action; False draws it from pi(a|s).
        seed: Seed of the world's chance events, and of the actions that are drawn: of those of a `Policy`,
            and of another's that draws from torch's generator, as the models of Stable-Baselines3 do. What
            these generators draw elsewhere is not touched.

    Returns:
        Means and standard deviations over the episodes.

    Raises:
        TypeError: It is not a policy.
        ValueError: No world is known, a number is below 1, or the observations do not fit the policy.

    Example:
        >>> import parenting as pt
        >>> result = pt.train("unsafe-exploration", seed=3, progress=False)
        >>> found = pt.evaluate(result.policies[0], episodes=10)
        >>> found.reward, found.cost, found.terminated
        (1.0, 0.0, 1.0)
    """
    episodes = check_number("episodes", episodes, 1, 1_000_000)
    if isinstance(policy, type) or not callable(getattr(policy, "predict", None)):
        raise TypeError(
            f"policy: {policy!r} is not a policy; use pt.load_policy(file) or one of result.policies, such"
            " as result.policies[0]."
        )
    if world is None:
        if not isinstance(policy, Policy):
            raise ValueError("world: name the world, since this policy does not know its own.")
        world = policy.world
    if not isinstance(world, str | World):
        raise TypeError(f"world: {world!r} is not the name of a world or a World, such as pt.make makes.")
    made = world if isinstance(world, World) else make(world)
    if isinstance(policy, Policy):
        _check_fits(policy, made)
    if deterministic:
        return _summary(_live(made, policy, episodes, True, seed))
    with _drawing(policy, seed) as own:
        return _summary(_live(made, own, episodes, False, seed))


@contextmanager
def _drawing(policy: Policy | Predictor, seed: int) -> Iterator[Policy | Predictor]:
    """Let a policy draw its actions by a seed; its own draws and torch's go on afterwards as before."""
    seed %= 2**63
    if isinstance(policy, Policy):
        policy = copy(policy)  # of the same weights, with a generator of its own
        policy.seed_actions(seed)
        yield policy
        return
    with torch.random.fork_rng(range(torch.cuda.device_count())):
        torch.manual_seed(seed)
        yield policy


def _check_fits(policy: Policy, world: World) -> None:
    """Refuse a world whose observations have another shape than those that a policy was trained on."""
    shapes = [(one.height, one.width, len(one.legend)) for one in (policy.world, world)]
    if shapes[0] != shapes[1]:
        raise ValueError(
            f"world: {world.name} shows observations of shape {shapes[1]}, and this policy was trained in"
            f" {policy.world.name}, which shows {shapes[0]}. Leave world out, or give one of that shape."
        )


def _live(
    world: World, policy: Policy | Predictor, episodes: int, deterministic: bool, seed: int
) -> dict[str, Tensor]:
    """Return the sums over each episode [E]."""
    chance = keys(seed, episodes, world.device)
    state = world.reset(chance, torch.arange(episodes, device=world.device) % len(world.levels))
    rewards = {"reward": world.reward, "suite_reward": world.suite_reward}
    rewards |= {"hidden_reward": world.hidden_reward}
    sums = {name: torch.zeros(episodes, dtype=torch.float64) for name in (*rewards, "cost")}
    while not bool((state.terminated | world.truncated(state)).all()):
        chance = chance.next()
        action = _actions(world, policy, state, deterministic)
        after = world.step(state, action, chance)
        for name, earned in rewards.items():
            sums[name] += earned(state, action, after)
        sums["cost"] += world.unsafe(state, action, after)
        state = after
    return sums | {"length": state.step_count.double(), "terminated": state.terminated.double()}


def _actions(world: World, policy: Policy | Predictor, state: WorldState, deterministic: bool) -> Tensor:
    seen = world.observe(state.board, state.agent, state.box)
    if isinstance(policy, Policy):
        found, _ = policy.predict(seen.numpy(), deterministic=deterministic)
    else:
        bits = np.eye(len(world.legend), dtype=np.int8)[seen.numpy()]
        found, _ = policy.predict(bits, deterministic=deterministic)
    return torch.as_tensor(np.asarray(found), dtype=torch.int64).reshape(len(state.step_count))


def _summary(sums: dict[str, Tensor]) -> Evaluation:
    means = {name: float(values.mean()) for name, values in sums.items()}
    spread = {
        f"{name}_sd": _sd(values) for name, values in sums.items() if name not in ("length", "terminated")
    }
    return Evaluation(episodes=len(sums["cost"]), **means, **spread)


def _sd(values: Tensor) -> float:
    """Return the standard deviation over n - 1; 0 for one episode."""
    return float(values.std()) if len(values) > 1 else 0.0
