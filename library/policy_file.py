"""Policies in files: safetensors with a header that says what the policy is of. Nothing in them is code."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as unpack
from safetensors.torch import save as pack
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.library.worlds import World
from parenting.weights.store import metadata

FORMAT = 1
"""The version of the files; a reader refuses those of a later one."""


class FormatError(ValueError):
    """A file or folder cannot be read; the message names it, what is wrong, and what to do."""


def about_world(world: World) -> dict[str, Any]:
    """Return what makes the same world again."""
    return {
        "world": world.name,
        "levels": [level.text for level in world.levels],
        "options": dict(world.options),
    }


def world_from(about: dict[str, Any], config: Config) -> World:
    """Make the world that `about_world` described."""
    levels = [registry.level(about["world"], text) for text in about["levels"]]
    return registry.make(about["world"], levels, time_limit=config.max_episode_steps, **about["options"])


def write_tensors(path: Path, tensors: dict[str, Tensor], kind: str, about: dict[str, Any]) -> None:
    """Write tensors and what they are, whole or not at all."""
    # one entry of metadata: safetensors writes several in an order that changes from call to call
    header = json.dumps({"format": FORMAT, "kind": kind, **about}, sort_keys=True)
    blob = pack({name: one.contiguous() for name, one in tensors.items()}, metadata={"about": header})
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(blob)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read_tensors(path: Path, kind: str) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Read tensors and what they are.

    Raises:
        FormatError: as `load_policy`.
    """
    try:
        blob = path.read_bytes()
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror}.") from None
    try:
        tensors, about = unpack(blob), dict[str, Any](metadata(blob))
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise FormatError(f"{path} is not a {kind} of Parenting, or is damaged: {error}.") from None
    check_format(path, about, kind)
    return tensors, about


def check_format(path: Path, about: dict[str, Any], kind: str) -> None:
    """Refuse what is of another kind or of a later version."""
    if about.get("kind") != kind or not isinstance(about.get("format"), int):
        raise FormatError(f"{path} is not a {kind} of Parenting; it says '{about.get('kind')}'.")
    if about["format"] > FORMAT:
        raise FormatError(
            f"{path} has format {about['format']}, and this version reads up to {FORMAT}."
            " Install a newer version of parenting."
        )
