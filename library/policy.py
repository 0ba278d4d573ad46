"""A trained policy pi(a|s) as an object of its own (Sec. 3.1.1)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from jaxtyping import Float, Float64, Int64
from numpy.typing import ArrayLike
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.library import observation as observations
from parenting.library.checks import path_of
from parenting.library.pictures import Drawing
from parenting.library.policy_drawing import drawn
from parenting.library.policy_file import FormatError, about_world, read_policy, world_from, write_policy
from parenting.library.worlds import World

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Policy:
    """The policy of one agent: pi(a|s) of Sec. 3.1.1, on the world that it was trained in.

    Attributes:
        world: The world that it was trained in.
        config: The hyperparameters that it was trained with.
        parameters: One flat row of weights [P], a copy that nothing else writes to.
        stage: The stage T that it came to (Sec. 2.4).
        trial: Its trial's number in the run.
        seed: The run's seed.
        about: What its file says of it, where it was read from one: `card` is its model card in Markdown, and
            `source` the run of a database that it was taken from.
    """

    def __init__(
        self,
        world: World,
        config: Config,
        parameters: Tensor,
        *,
        stage: int = 1,
        trial: int = 0,
        seed: int = 0,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        """Copy the parameters, so that no later training changes this policy.

        Raises:
            ValueError: There are not as many parameters as the world's network has.
        """
        self._network = network_of(world)
        if parameters.shape != (self._network.size,):
            raise ValueError(
                f"parameters: {world.name} at {world.height} x {world.width} needs {self._network.size}"
                f" numbers, not an array of shape {tuple(parameters.shape)}."
            )
        self.world, self.config = world, config
        self.parameters: Float[Tensor, "P"] = parameters.detach().clone()
        self.stage, self.trial, self.seed = stage, trial, seed
        self.about: Mapping[str, Any] = about or {}
        self._generator = np.random.default_rng(seed)

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.int64] | np.int64, None]:
        """Choose an action, with the signature of Stable-Baselines3.

        Args:
            observation: One-hot bits (H, W, O) as Gymnasium gives them, or codes (H, W), or N of either.
            state: Ignored: this policy has no memory.
            episode_start: Ignored, for the same reason.
            deterministic: Take the most probable action; False draws it from pi(a|s).

        Returns:
            The action (0 up, 1 down, 2 left, 3 right), or an array of N actions; and None, the state of a
            policy without memory.

        Raises:
            ValueError: The observation's shape does not fit the world.

        Example:
            >>> import parenting as pt
            >>> result = pt.train("unsafe-exploration", seed=3, progress=False)
            >>> import gymnasium, parenting.envs.gym
            >>> env = gymnasium.make("parenting/UnsafeExploration-v0")
            >>> observation, info = env.reset(seed=0)
            >>> action, _ = result.policies[0].predict(observation)
            >>> int(action) in range(4)
            True
        """
        logits, single = self._logits(observation)
        if deterministic:
            actions = logits.argmax(1).numpy()
        else:
            noise = self._generator.gumbel(size=tuple(logits.shape))
            actions = (logits.numpy() + noise).argmax(1)
        return (actions[0] if single else actions), None

    def probabilities(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Return pi(a|s): the softmax of the mean of both heads' logits (Sec. 3.1.1).

        Args:
            observation: As `predict` takes it.

        Returns:
            Probabilities of shape (4,), in the order up, down, left, right; or (N, 4).

        Raises:
            ValueError: The observation's shape does not fit the world.
        """
        logits, single = self._logits(observation)
        found: NDArray[np.float64] = logits.softmax(1).numpy()
        return found[0] if single else found

    def logits(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Return the logits of pi(a|s), the mean of both heads' (Sec. 3.1.1).

        They have no unit: a difference of two is the natural logarithm of the ratio of the two actions'
        probabilities, and their softmax is `probabilities`. They are computed in the config's `dtype`.

        Args:
            observation: As `predict` takes it.

        Returns:
            Logits of shape (4,), in the order up, down, left, right; or (N, 4).

        Raises:
            ValueError: The observation's shape does not fit the world.
        """
        logits, single = self._logits(observation)
        found: NDArray[np.float64] = logits.numpy()
        return found[0] if single else found

    def actions(self, seen: Tensor, near: Tensor) -> Int64[Tensor, "N"]:
        """Return the most probable actions for observed boards [N, H, W] and local states [N, 4]."""
        return self._of(seen, near).argmax(1)

    def save(self, path: str | Path) -> Path:
        """Write the policy to a file of safetensors, whole or not at all.

        The file holds the weights and, as metadata, a model card: the world, its level, the config, the
        format's version and a hash of the weights. Nothing in it is code. `parenting.load_policy` reads it.

        Returns:
            The path of the file.
        """
        about = {
            **about_world(self.world),
            "config": self.config.model_dump(mode="json"),
            "stage": self.stage,
            "trial": self.trial,
            "seed": self.seed,
        }
        known = {name: self.about[name] for name in ("source", "origin") if name in self.about}
        write_policy(Path(path), self.parameters, {**about, **known})
        return Path(path)

    def seed_actions(self, seed: int) -> None:
        """Restart the draws of `predict(deterministic=False)` from a seed."""
        self._generator = np.random.default_rng(seed)

    def _logits(self, observation: ArrayLike) -> tuple[Float64[Tensor, "N 4"], bool]:
        seen, single = observations.codes(self.world, observation)
        return self._of(seen, observations.local_states(self.world, seen)), single

    def _of(self, seen: Tensor, near: Tensor) -> Float64[Tensor, "N 4"]:
        """Return the logits; one trial in N states, so that its weights are read once."""
        with torch.no_grad():
            layers = self._network.unpack(self.parameters[None])
            return self._network.heads(layers, seen[None], near[None]).logits[0].double()

    def drawing(self) -> Drawing:
        """Draw arrows on the levels that it was trained on; `show` does."""
        return drawn(self.world, self.probabilities)

    def _repr_html_(self) -> str:
        return self.drawing()._repr_html_()

    def __repr__(self) -> str:
        return f"<Policy {self.world.name}, level {self.world.levels[0].name}, stage {self.stage}>"


def load_policy(path: str | Path) -> Policy:
    """Read a policy that `Policy.save`, `parenting policy` or a run's dashboard wrote.

    Args:
        path: The file.

    Returns:
        The policy, on the world and level that it was trained in.

    Raises:
        FormatError: There is no such file, it is not a policy, it is damaged (its weights do not have its
            hash), or a later version wrote it.

    Example:
        >>> import parenting as pt
        >>> result = pt.train("unsafe-exploration", seed=3, progress=False)
        >>> file = result.policies[0].save("careful.safetensors")
        >>> pt.load_policy(file)
        <Policy unsafe-exploration, level island, stage 1>
    """
    path = path_of("path", path)
    parameters, about = read_policy(path)
    try:
        config = Config.model_validate(about["config"])
        own = {name: about[name] for name in ("stage", "trial", "seed")}
        return Policy(world_from(path, about, config), config, parameters, **own, about=about)
    except FormatError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(f"{path} is damaged: {str(error).rstrip('.')}.") from None
