"""Policies in files: safetensors with a header that says what the policy is of. Nothing in them is code."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load as unpack
from safetensors.torch import save as pack
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.installed import BrokenPackageError
from parenting.envs.names import UnknownNameError
from parenting.library.worlds import World
from parenting.weights import policy_file
from parenting.weights.policy_file import FORMAT, PolicyFileError, check_header
from parenting.weights.store import metadata

__all__ = [
    "FORMAT",
    "FormatError",
    "about_world",
    "check_format",
    "read_policy",
    "read_tensors",
    "world_from",
    "write_policy",
    "write_tensors",
]


class FormatError(ValueError):
    """A file or folder cannot be read; the message names it, what is wrong, and what to do."""


def about_world(world: World) -> dict[str, Any]:
    """Return what makes the same world again."""
    return {
        "world": world.name,
        "levels": [level.text for level in world.levels],
        "options": dict(world.options),
    }


def world_from(path: Path, about: dict[str, Any], config: Config) -> World:
    """Make the world that `about_world` described in a file or folder.

    Raises:
        FormatError: this process does not know the world, or its package cannot be used.
    """
    name, levels = about["world"], about["levels"]
    try:
        registry.spec(name, levels[0] if levels else None)
    except BrokenPackageError as error:
        raise FormatError(f"{path} cannot be read: {error}") from None
    except UnknownNameError:
        raise FormatError(
            f"{path} was trained in the world '{name}', which this process does not know. Import the module"
            " that registers it (pt.register), or install its package."
        ) from None
    made = [registry.level(name, text) for text in levels]
    return registry.make(name, made, time_limit=config.max_episode_steps, **about["options"])


def write_tensors(path: Path, tensors: dict[str, Tensor], kind: str, about: dict[str, Any]) -> None:
    """Write tensors and what they are, whole or not at all."""
    # one entry of metadata: safetensors writes several in an order that changes from call to call
    header = json.dumps({"format": FORMAT, "kind": kind, **about}, sort_keys=True)
    _write(path, pack({name: one.contiguous() for name, one in tensors.items()}, metadata={"about": header}))


def write_policy(path: Path, parameters: Tensor, about: Mapping[str, Any]) -> None:
    """Write a policy with its model card, whole or not at all."""
    row = parameters.detach().cpu().contiguous()
    dtype = str(row.dtype).removeprefix("torch.")
    _write(path, policy_file.pack(row.numpy().tobytes(), dtype, about))


def read_policy(path: Path) -> tuple[Tensor, dict[str, Any]]:
    """Read the parameters of a policy and its header.

    Raises:
        FormatError: as `load_policy`.
    """
    try:
        found = policy_file.unpack(_bytes(path))
    except PolicyFileError as error:
        raise FormatError(f"{path} cannot be read as a policy: {error}.") from None
    row = torch.frombuffer(bytearray(found.data), dtype=getattr(torch, found.dtype))
    return row, found.about


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror}.") from None


def _write(path: Path, blob: bytes) -> None:
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
    blob = _bytes(path)
    try:
        tensors, about = unpack(blob), dict[str, Any](metadata(blob))
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise FormatError(f"{path} is not a {kind} of Parenting, or is damaged: {error}.") from None
    check_format(path, about, kind)
    return tensors, about


def check_format(path: Path, about: dict[str, Any], kind: str) -> None:
    """Refuse what is of another kind or of a later version."""
    try:
        check_header(about, kind)
    except PolicyFileError as error:
        raise FormatError(f"{path} cannot be read: {error}.") from None
