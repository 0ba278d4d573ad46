"""Weights pre-trained on mazes: one file for each world, size and version. No torch until one is read.

`parenting pretrain` makes them. Those of the built-in levels are shipped beside this file; others stand in
the folder `weights` of the data folder, which is looked at first. A run records the SHA-256 of the file that
it began with, and only a file with that hash serves it afterwards.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from envs.levels.kind import Kind, maze_legend

if TYPE_CHECKING:
    from torch import Tensor

VERSION = 1
"""Counts the ways of making weights: network, mazes, rewards. Those of another way do not serve."""
SHIPPED = Path(__file__).parent
SUFFIX = ".safetensors"


class NoWeights(ValueError):
    """There are no such weights, or not those that a run began with; the sentence says how to get them."""


class Wanted(NamedTuple):
    """What weights belong to."""

    world: Kind
    height: int
    width: int

    @property
    def name(self) -> str:
        """The name of their file, without suffix."""
        return f"{self.world.name}-{self.height}x{self.width}-v{VERSION}"

    @property
    def metadata(self) -> dict[str, str]:
        """What the file says of itself, and must say to serve."""
        size = f"{self.height}x{self.width}"
        return {"size": size, "legend": maze_legend(self.world.glyphs), "version": str(VERSION)}


def digest(path: Path) -> str:
    """A file's SHA-256, in hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def find(wanted: Wanted, folder: Path | None = None, sha256: str | None = None) -> Path:
    """The file of these weights: the first of `folder` and the shipped ones, or the one with this hash.

    Raises:
        NoWeights: there is none; the sentence names the command that makes them.
    """
    places = [place / f"{wanted.name}{SUFFIX}" for place in (folder, SHIPPED) if place is not None]
    there = [path for path in places if path.is_file()]
    for path in there:
        if sha256 is None or digest(path) == sha256:
            return path
    size = f"{wanted.height} x {wanted.width}"
    if there:
        raise NoWeights(
            f"The pre-trained weights of {wanted.world.name} at {size} are not those that this run began with"
            f" (SHA-256 {sha256}): bring that file back as {there[0].name}, or start a new run."
        )
    raise NoWeights(
        f"There are no pre-trained weights for {wanted.world.name} at {size}. Make them with"
        f" `parenting pretrain --world {wanted.world.name} --size {wanted.height}x{wanted.width}`,"
        " or set pretrain to false."
    )


def load(path: Path, wanted: Wanted) -> Tensor:
    """The weights of a file, one flat row [P].

    Raises:
        NoWeights: the file cannot be read, or holds something else.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as file:
            said = file.metadata() or {}
            weights: Tensor = file.get_tensor("weights")
    except (SafetensorError, OSError) as error:
        raise NoWeights(f"{path.name} cannot be read as weights: {error}.") from None
    for key, value in wanted.metadata.items():
        if said.get(key) != value:
            raise NoWeights(f"{path.name} is of {key} '{said.get(key)}', and '{value}' is wanted.")
    return weights


def save(path: Path, wanted: Wanted, weights: Tensor, about: Mapping[str, str]) -> str:
    """Write weights whole or not at all; `about` says how they came to be. Returns the file's SHA-256."""
    from safetensors.torch import save as pack

    path.parent.mkdir(parents=True, exist_ok=True)
    blob = pack({"weights": weights.contiguous()}, metadata={**wanted.metadata, **about})
    part = path.with_suffix(".new")
    part.write_bytes(blob)
    part.replace(path)
    return hashlib.sha256(blob).hexdigest()
