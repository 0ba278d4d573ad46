"""Gymnasium's ids in fresh processes: who registers them, and what is loaded for it."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.tree import ROOT

UNSAFE = "parenting:parenting/UnsafeExploration-v0"


def run(script: str) -> str:
    """The output of a fresh process; warnings are errors."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize("name", [UNSAFE, "parenting.envs.gym:parenting/UnsafeExploration-v0"])
def test_an_id_with_its_module_needs_no_other_import(name: str) -> None:
    script = f"import gymnasium; env = gymnasium.make({name!r}); env.reset(seed=0); print(env.step(1)[1])"
    assert run(script) == "-1.0"


@pytest.mark.slow
def test_neither_does_a_vector_of_them() -> None:
    script = f"import gymnasium; print(type(gymnasium.make_vec({UNSAFE!r}, num_envs=2)).__name__)"
    assert run(script) == "GridworldVectorEnv"


@pytest.mark.slow
def test_ids_are_registered_once_and_load_nothing() -> None:
    script = (
        "import sys, gymnasium, parenting\n"
        "print(sum(name.startswith('parenting/') for name in gymnasium.registry), 'torch' in sys.modules)\n"
        "import parenting.envs.gym"  # a second registration would warn
    )
    assert run(script) == "5 False"


@pytest.mark.slow
@pytest.mark.parametrize("order", [["adapter", "mine"], ["mine", "adapter"]])
def test_a_world_of_ones_own_has_an_id_whatever_comes_first(order: list[str]) -> None:
    steps = {
        "adapter": "import gymnasium, parenting.envs.gym",
        "mine": (
            "from dataclasses import replace\nimport parenting as pt\n"
            "from parenting.envs.unsafe_exploration import UnsafeExploration\n"
            "class Mine(UnsafeExploration):\n"
            "    spec = replace(UnsafeExploration.spec, name='my-world', rules='__main__:Mine')\n"
            "for name in ('my-world', 'no id'):\n"
            "    pt.register(replace(Mine.spec, name=name))"
        ),
    }
    made = "env = gymnasium.make('parenting/MyWorld-v0'); env.reset(seed=0); print(env.step(1)[1])"
    assert run("\n".join([*(steps[one] for one in order), made])) == "-1.0"


@pytest.mark.slow
@pytest.mark.faults
def test_many_processes() -> None:
    """Each spawned process finds the worlds by the module. Three processes load torch."""
    script = (
        "import gymnasium\n"
        "if __name__ == '__main__':\n"
        f"    envs = gymnasium.make_vec({UNSAFE!r}, num_envs=2, vectorization_mode='async',\n"
        "        vector_kwargs={'context': 'spawn'})\n"
        "    envs.reset(seed=0)\n"
        "    print(envs.step([1, 1])[4]['hidden_reward'].tolist())\n"
        "    envs.close()"
    )
    assert run(script) == "[-1.0, -1.0]"
