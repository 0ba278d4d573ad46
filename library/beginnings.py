"""The files that `train` begins with: an earlier policy, and an export of earlier answers."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from parenting.library.checks import path_of
from parenting.library.policy import Policy
from parenting.weights.origin import Origin, UnreadableOriginError, read_origin


def origin_of(from_policy: str | Path | Policy | None, from_answers: str | Path | None) -> Origin:
    """Read the files that a training should begin with.

    Raises:
        TypeError: an argument is neither a path nor, for `from_policy`, a `Policy`.
        ValueError: a file cannot be read, or is of something else; the message names the argument.
    """
    with TemporaryDirectory(prefix="parenting-") as folder:
        if isinstance(from_policy, Policy):
            from_policy = from_policy.save(Path(folder) / "policy.safetensors")
        policy = None if from_policy is None else path_of("from_policy", from_policy)
        answers = None if from_answers is None else path_of("from_answers", from_answers)
        try:
            return read_origin(policy, answers)
        except UnreadableOriginError as error:
            raise ValueError(f"{error.field}: {error}") from None
