"""Where numbers come from: the commit, the versions, and the settings that tasks name but do not hold."""

from __future__ import annotations

import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from parenting.agent.config import compose, v1_names
from parenting.envs import registry
from parenting.weights.store import SHIPPED, SUFFIX, digest

PRESETS_OF_THE_PAPER = ("conservative", "lax", "direct")
LIBRARIES = ("parenting", "torch", "numpy", "joblib")


@cache
def commit() -> str | None:
    """The commit of the checkout, with a mark if files were changed since; none outside of one."""
    try:
        said = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return said.stdout.strip()


def versions() -> dict[str, str]:
    """Of Python, the machine, and the libraries that numbers may depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def settings() -> dict[str, Any]:
    """Return the settings of every experiment: Table 1's presets in full, worlds' changes, shipped weights.

    A task names a preset and a world; here stands what these were. Weights are named by their SHA-256. An
    experiment that uses another preset than those of Table 1 writes it into its own config.
    """
    return {
        "presets": {
            name: compose(name, {}, {}, strict=True).model_dump(mode="json") for name in PRESETS_OF_THE_PAPER
        },
        "worlds": {world: v1_names(registry.defaults(world)) for world in sorted(registry.WORLDS)},
        "weights": {path.name: digest(path.read_bytes()) for path in sorted(SHIPPED.glob(f"*{SUFFIX}"))},
    }
