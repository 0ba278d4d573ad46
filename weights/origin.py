"""The files that agents may begin with: an earlier policy, and earlier answers. No torch.

A stored run keeps their hashes and where they came from (`Origin.about`), and their bytes under these hashes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parenting.agent.architecture import weights_of
from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.levels.spec import Level, LevelError, maze_legend
from parenting.envs.names import UnknownNameError
from parenting.envs.people_text import printable
from parenting.weights import answers_export, answers_file, policy_file
from parenting.weights.answers_file import Answers, AnswersFileError
from parenting.weights.policy_file import PolicyFileError, StoredPolicy
from parenting.weights.store import digest

FROM_POLICY, FROM_ANSWERS = "from_policy", "from_answers"
"""The names of the two files as fields, for messages."""
LONGEST, LARGEST = 100, 2**53
"""Characters of a name, and the numbers that every reader of JSON keeps."""
Wrong = list[tuple[str, str]]


class UnreadableOriginError(ValueError):
    """A file that a run should begin with cannot be read; `field` is its name as an argument."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


@dataclass(frozen=True)
class Origin:
    """The files that a run begins with, read and sound."""

    policy: StoredPolicy | None = None
    answers: Answers | None = None
    about: Mapping[str, Any] | None = None  # as a run keeps it; None: the run begins as any other
    blobs: tuple[tuple[str, bytes], ...] = ()  # names and bytes to store, by their hashes in `about`

    def misfits(self, level: Level, config: Config) -> Wrong:
        """Return what of a run does not fit, as (field, sentence)."""
        wrong: Wrong = []
        if self.policy is not None:
            wrong += _policy_misfits(self.policy, level, config)
        if self.answers is not None:
            world = registry.spec(level.world)
            size = (level.height, level.width)
            wrong += answers_file.misfits(
                self.answers, level.world, size, world.glyphs, config.max_clip_length
            )
        return wrong


NO_ORIGIN = Origin()


def read_origin(from_policy: Path | None, from_answers: Path | None) -> Origin:
    """Read the files that a run should begin with.

    Raises:
        UnreadableOriginError: one of them cannot be read, or is of something else.
    """
    policy = None if from_policy is None else (str(from_policy), _bytes(FROM_POLICY, from_policy))
    answers = None if from_answers is None else (str(from_answers), _answers(from_answers))
    return origin_of(policy, answers)


def origin_of(from_policy: tuple[str, bytes] | None, from_answers: tuple[str, bytes] | None) -> Origin:
    """Return the origin of a run from the names and the bytes of files.

    Raises:
        UnreadableOriginError: one of them is damaged, or of something else.
    """
    if from_policy is None and from_answers is None:
        return NO_ORIGIN
    about, blobs = dict[str, Any](), list[tuple[str, bytes]]()
    policy, answers = None, None
    if from_policy is not None:
        name, blob = Path(from_policy[0]).name, from_policy[1]
        try:
            policy = policy_file.unpack(blob)
        except PolicyFileError as error:
            raise UnreadableOriginError(FROM_POLICY, f"{from_policy[0]}: {error}.") from None
        about["policy"] = {
            "sha256": digest(blob),
            "stored": digest(blob),
            "file": printable(name, breaks=False),
            "stage": _plain(policy.about.get("stage")),
            **_source(policy.about.get("source")),
        }
        blobs.append((name, blob))
    if from_answers is not None:
        name, blob = Path(from_answers[0]).name, from_answers[1]
        try:
            answers = answers_file.read_answers(blob)
        except AnswersFileError as error:
            raise UnreadableOriginError(FROM_ANSWERS, f"{from_answers[0]}: {error}.") from None
        kept = answers_file.pack_answers(answers)
        about["answers"] = {
            "sha256": digest(blob),
            "stored": digest(kept),
            "file": printable(name, breaks=False),
            "answers": len(answers.rows),
            "run": _plain(answers.run),
            "database": _plain(answers.database),
        }
        blobs.append((name, kept))
    return Origin(policy, answers, about, tuple(blobs))


def _source(source: Any) -> dict[str, Any]:
    """Return the run that a policy was taken from; none of a policy that `pt.train` trained."""
    known = source if isinstance(source, Mapping) else {}
    return {name: _plain(known.get(name)) for name in ("run", "database", "tick")}


def _plain(told: Any) -> str | int | None:
    """Return a name or a whole number of a file; None of all else, which a run cannot keep or show."""
    if isinstance(told, str) and len(told) <= LONGEST and told.isprintable():
        return told
    return told if isinstance(told, int) and 0 <= told < LARGEST else None


def _bytes(field: str, path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UnreadableOriginError(field, f"{path} cannot be read: {error.strerror}.") from None


def _answers(path: Path) -> bytes:
    """Return the lines of a table of answers, or those that an export of whole runs holds."""
    if not answers_export.is_export(path):
        return _bytes(FROM_ANSWERS, path)
    try:
        return answers_export.lines_of(path)
    except AnswersFileError as error:
        raise UnreadableOriginError(FROM_ANSWERS, f"{path}: {error}.") from None


def _policy_misfits(policy: StoredPolicy, level: Level, config: Config) -> Wrong:
    said = policy.about
    if said.get("world") != level.world:
        return [("world", f"The policy is of the world {said.get('world')}, not of {level.world}.")]
    try:
        theirs = registry.level(level.world, said["levels"][0])
    except (KeyError, IndexError, TypeError, AttributeError, LevelError, UnknownNameError):
        return [(FROM_POLICY, "Its header is damaged: it names no level of its world.")]
    if (theirs.height, theirs.width) != (level.height, level.width):
        return [
            (
                "level",
                f"The policy is for boards of {theirs.height} x {theirs.width}, and this level has"
                f" {level.height} x {level.width}.",
            )
        ]
    weights = weights_of(level.height, level.width, len(maze_legend(registry.spec(level.world).glyphs)))
    if len(policy.data) != weights * policy_file.BYTES[policy.dtype]:
        return [(FROM_POLICY, f"It is damaged: a policy for this level has {weights} parameters.")]
    if policy.dtype != config.dtype:
        return [("config.dtype", f"The policy has numbers of {policy.dtype}, and the run of {config.dtype}.")]
    return []
