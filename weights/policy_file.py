"""Files of policies: safetensors with a header that says what the policy is of, and a model card. No torch.

The header is one entry of metadata, JSON. It holds the SHA-256 of the parameters, since safetensors has no
checksum of its own.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from parenting._plural import counted
from parenting.weights.store import ABOUT, metadata

FORMAT = 1
"""The version of the files; a reader refuses those of a later one."""
KIND = "policy"
PARAMETERS = "parameters"
"""The name of the one tensor: a flat row of weights [P]."""
DIGEST = "parameters_sha256"
TYPES = {"F32": "float32", "F64": "float64"}
"""The type of a number, by the name that safetensors has for it."""
BYTES = {"float32": 4, "float64": 8}
"""Bytes of a number, by the type that `Config.dtype` names."""


class PolicyFileError(ValueError):
    """The bytes are not a policy of Parenting, are damaged, or are of a later version."""


class StoredPolicy(NamedTuple):
    """The content of a policy's file, its tensor as bytes."""

    about: dict[str, Any]
    dtype: str
    data: bytes


def pack(data: bytes, dtype: str, about: Mapping[str, Any]) -> bytes:
    """Return the bytes of a policy's file.

    Args:
        data: The parameters, one flat row of little-endian numbers.
        dtype: float32 or float64.
        about: World, levels, options, config, stage, trial and seed, and what else is known of it.
    """
    said = {"format": FORMAT, "kind": KIND, **about, DIGEST: hashlib.sha256(data).hexdigest()}
    header = json.dumps({**said, "card": card(said)}, sort_keys=True)
    # Written by hand: without numpy or torch, safetensors takes addresses in memory only.
    row = {
        "dtype": {name: code for code, name in TYPES.items()}[dtype],
        "shape": [len(data) // BYTES[dtype]],
        "data_offsets": [0, len(data)],
    }
    begin = json.dumps({"__metadata__": {ABOUT: header}, PARAMETERS: row}).encode()
    begin += b" " * (-len(begin) % 8)
    return len(begin).to_bytes(8, "little") + begin + data


def unpack(blob: bytes) -> StoredPolicy:
    """Read a policy's file, and hold its parameters against their hash.

    Raises:
        PolicyFileError: the bytes are not of a policy, are damaged, or a later version wrote them.
    """
    from safetensors import SafetensorError, deserialize

    try:
        tensors = dict(deserialize(blob))  # type: ignore[no-untyped-call]  # safetensors has no types for it
        about = dict[str, Any](metadata(blob))
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise PolicyFileError(f"it is not a policy of Parenting, or is damaged: {error}") from None
    except RecursionError:
        raise PolicyFileError("it is not a policy of Parenting: its header is nested too deep") from None
    check_header(about, KIND)
    row = tensors.get(PARAMETERS)
    dtype = TYPES.get("" if row is None else row["dtype"])
    if row is None or dtype is None or len(row["shape"]) != 1:
        raise PolicyFileError(f"it is damaged: it has no flat row '{PARAMETERS}' of numbers")
    data = bytes(row["data"])
    check_digest(about, data)
    return StoredPolicy(about, dtype, data)


def check_header(about: Mapping[str, Any], kind: str) -> None:
    """Refuse a header of another kind or of a later version.

    Raises:
        PolicyFileError: it is one of these.
    """
    if about.get("kind") != kind or not isinstance(about.get("format"), int):
        raise PolicyFileError(f"it is not a {kind} of Parenting; it says '{about.get('kind')}'")
    if about["format"] > FORMAT:
        raise PolicyFileError(
            f"it has format {about['format']}, and this version reads up to {FORMAT}."
            " Install a newer version of parenting"
        )


def check_digest(about: Mapping[str, Any], data: bytes) -> None:
    """Hold parameters against the hash of their header; files of before version 0.5 have none.

    Raises:
        PolicyFileError: they were changed.
    """
    if DIGEST in about and hashlib.sha256(data).hexdigest() != about[DIGEST]:
        raise PolicyFileError("it is damaged: its parameters are not those that were written")


def card(about: Mapping[str, Any]) -> str:
    """Return the model card of a policy: Markdown, from its header."""
    config = about["config"]
    names = re.findall(r"^name: *(.+)$", "\n".join(about["levels"]), re.MULTILINE)
    lines = [
        f"# A policy for {about['world']}",
        "",
        f"Trained by PARENTING (arXiv 1902.06766) in the world {about['world']}, level"
        f" {', '.join(names)}; stage {about['stage']}, seed {about['seed']}. No reward was read: the agent"
        " learnt from a parent's answers.",
        "",
        *_origin(about),
        f"- Config: {', '.join(f'{name}={value}' for name, value in sorted(config.items()))}",
        f"- SHA-256 of the parameters: {about[DIGEST]}",
        "",
        'Load it: `import parenting as pt; policy = pt.load_policy("FILE.safetensors")`, then'
        " `action, _ = policy.predict(observation)`. It knows its own world: `policy.world`.",
    ]
    return "\n".join(lines) + "\n"


def _origin(about: Mapping[str, Any]) -> list[str]:
    source = about.get("source")
    if source is None:
        return []
    size = f"{source['entries']} answered queries in {counted(source['rows'], 'row')}"
    return [
        f"- Run: {source['run']} of the database {source['database']}, after tick {source['tick']}",
        f"- Parent: {source['parent']}; answers heard: {source['answers']}; X: {size}",
    ]
