"""Weights pre-trained on mazes: one file for each world, size and version. No torch until one is read.

`parenting pretrain` makes them. Those of the built-in levels are shipped beside this file; others stand in
the folder `weights` of the data folder, which is looked at first. A run records the SHA-256 of the file that
it began with.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from parenting.envs.levels.spec import WorldSpec, maze_legend

if TYPE_CHECKING:
    from jaxtyping import Float
    from torch import Tensor

    from parenting.agent.config import Config
    from parenting.envs.gridworld import Gridworld

VERSION = 1
"""Counts the ways of making weights: network, mazes, rewards. Those of another way do not serve."""
SHIPPED = Path(__file__).parent
SUFFIX = ".safetensors"
ABOUT = "about"
"""The one entry of a file's metadata: JSON."""


class NoWeightsError(ValueError):
    """There are no such weights, or they cannot be read; the sentence says how to get them."""


class Wanted(NamedTuple):
    """The world and the size that weights belong to."""

    world: WorldSpec
    height: int
    width: int

    @property
    def name(self) -> str:
        """The name of their file, without suffix."""
        return f"{self.world.name}-{self.height}x{self.width}-v{VERSION}"

    @property
    def metadata(self) -> dict[str, str]:
        """The header of the file, which must agree for the weights to be used."""
        size = f"{self.height}x{self.width}"
        return {"size": size, "legend": maze_legend(self.world.glyphs), "version": str(VERSION)}


def digest(blob: bytes) -> str:
    """The SHA-256 of a file's bytes, in hexadecimal digits."""
    return hashlib.sha256(blob).hexdigest()


def find(wanted: Wanted, folder: Path | None = None) -> Path:
    """The file of these weights: in `folder`, or else among the shipped ones.

    Raises:
        NoWeightsError: there is none; the sentence names the command that makes them.
    """
    for place in (folder, SHIPPED):
        if place is not None and (path := place / f"{wanted.name}{SUFFIX}").is_file():
            return path
    raise NoWeightsError(
        f"There are no pre-trained weights for {wanted.world.name} at {wanted.height} x {wanted.width}."
        f" Make them with `parenting pretrain --world {wanted.world.name}"
        f" --size {wanted.height}x{wanted.width}`, or set pretrain to false."
    )


def load(blob: bytes, wanted: Wanted) -> Tensor:
    """The weights in a file's bytes, one flat row [P].

    Raises:
        NoWeightsError: the bytes cannot be read, or hold something else.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load as unpack

    try:
        weights: Tensor = unpack(blob)["weights"]  # holds the header against the format, too
        said = metadata(blob)
    except (SafetensorError, ValueError, KeyError) as error:
        raise NoWeightsError(f"{wanted.name} cannot be read as weights: {error}.") from None
    for key, value in wanted.metadata.items():
        if said.get(key) != value:
            raise NoWeightsError(f"{wanted.name} has {key} '{said.get(key)}', not '{value}'.")
    return weights


def shipped(wanted: Wanted) -> Tensor:
    """The shipped weights, one flat row [P].

    Raises:
        NoWeightsError: there are none.
    """
    return load(find(wanted).read_bytes(), wanted)


def pretrained(world: Gridworld) -> Float[Tensor, "P"]:
    """Read the shipped weights for a world (Sec. 3.1.4), one flat row.

    Raises:
        NoWeightsError: there are none for its specification and size.
    """
    return shipped(Wanted(world.spec, world.height, world.width))


def initial_weights(world: Gridworld, config: Config) -> Float[Tensor, "P"] | None:
    """Read the weights that the trials of a world begin with; None where the config asks for none.

    Raises:
        NoWeightsError: as `pretrained`.
    """
    return pretrained(world) if config.pretrain else None


def metadata(blob: bytes) -> dict[str, str]:
    """Read the header of a file: JSON, behind eight bytes that hold its length.

    Raises:
        ValueError, KeyError: no such header.
    """
    length = int.from_bytes(blob[:8], "little")
    header = json.loads(blob[8 : 8 + length])
    said: dict[str, str] = json.loads(header["__metadata__"][ABOUT])
    return said


def packed(wanted: Wanted, weights: Tensor, about: Mapping[str, str]) -> bytes:
    """Return the bytes of a file of weights; `about` says how they came to be."""
    from safetensors.torch import save as pack

    # one entry of metadata: safetensors writes several in an order that changes from call to call
    said = json.dumps({**wanted.metadata, **about}, sort_keys=True)
    return pack({"weights": weights.contiguous()}, metadata={ABOUT: said})


def save(path: Path, wanted: Wanted, weights: Tensor, about: Mapping[str, str]) -> str:
    """Write weights whole or not at all; `about` says how they came to be. Returns the file's SHA-256."""
    path.parent.mkdir(parents=True, exist_ok=True)
    blob = packed(wanted, weights, about)
    part = path.with_suffix(".new")
    part.write_bytes(blob)
    part.replace(path)
    return digest(blob)
