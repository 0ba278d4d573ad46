"""The grammar of parents: `NAME[:key=value,...]`, several joined by `+` (docs/commands.md, "Parents")."""

from __future__ import annotations

import re
from importlib import import_module
from inspect import isabstract
from typing import NamedTuple

from pydantic import ValidationError

from parenting.envs.installed import BrokenPackageError, Installed
from parenting.envs.names import did_you_mean
from parenting.parents.errors import PARTS, Part

PLUS = re.compile(r"(?<![0-9.][eE])\+")
"""Joins parents; the plus of 1e+16 does not."""


class ParentError(ValueError):
    """A text does not name a parent; the sentence says why, and what would."""


NAME = re.compile(r"[a-z][a-z0-9_-]*")
"""The name of a parent of another package: none of the signs of the grammar."""


def _usable(name: str, found: object) -> type[Part]:
    """Return what an entry point names as a part of a parent.

    Raises:
        TypeError: it is not a subclass of `Part`.
        ValueError: its name cannot be written, or is that of a parent of ours.
    """
    if not (isinstance(found, type) and issubclass(found, Part)) or isabstract(found):
        raise TypeError(f"its entry point names {found!r}, and a whole subclass of Part is wanted")
    if not NAME.fullmatch(name) or name in PARTS:
        raise ValueError("its name must be of lower-case letters, digits, - and _, and be none of ours")
    return found


INSTALLED = Installed("parenting.parents", "parent", _usable)
"""The parents of other packages."""


class ParentSpec(NamedTuple):
    """A parent by its parts, in the order in which they change an answer. Plain data."""

    parts: tuple[Part, ...]

    def __str__(self) -> str:
        """The text of this parent, with the value of every parameter."""
        return "+".join(_written(part) for part in self.parts)

    @property
    def errs(self) -> bool:
        """Return whether it is another than the paper's."""
        return any(type(part) is not PARTS["scripted"] for part in self.parts)


SCRIPTED = ParentSpec((PARTS["scripted"](),))
"""The paper's parent, who never errs (Sec. 3.1.3)."""


def read_parent(text: str, *, imports: bool = True) -> ParentSpec:
    """Return the parent that a text names, such as `noisy:0.1` or `boltzmann:beta=5+tiring`.

    A first value without a key belongs to the first parameter of its part. A server reads with `imports` off:
    whoever sends it a text would otherwise choose what it imports.

    Raises:
        ParentError: there is no such parent or parameter, or a value is out of bounds.
    """
    parts = tuple(_part(one.strip(), imports) for one in PLUS.split(text))
    judging = [part for part in parts if part.judges]
    if len(judging) > 1:
        names = " and ".join(part.name for part in judging)
        raise ParentError(f"{names} each judge by themselves: give one of them.")
    for place, part in enumerate(parts):
        if part.judges and place:
            raise ParentError(
                f"{part.name} judges by itself, so it stands first: {part.name}+{parts[0].name}, for example."
            )
    return ParentSpec(parts)


def read_script(text: str) -> str:
    """Return a parent's text as it is stored: with the value of every parameter.

    Raises:
        ParentError: as `read_parent`, and for an import path.
    """
    return str(read_parent(text, imports=False))


def _part(text: str, imports: bool) -> Part:
    name, colon, rest = text.partition(":")
    if "." in name and not imports:
        raise ParentError(f"'{name}' is an import path, and a run takes none. {_known()}")
    kind = _imported(name) if "." in name else _named(name)
    given = _values(kind, rest.split(",") if colon else [])
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        first = error.errors()[0]
        raise ParentError(f"{name}:{first['loc'][0]}={first['input']}: {first['msg']}.") from None


def _named(name: str) -> type[Part]:
    """Return the parent of a name: one of ours, or one of another package.

    Raises:
        ParentError: there is none, or its package cannot be used.
    """
    kind = PARTS.get(name) or INSTALLED.get(name)
    if kind is not None:
        return kind
    try:
        INSTALLED.refuse(name)
    except BrokenPackageError as error:
        raise ParentError(str(error)) from None
    raise ParentError(f"There is no parent '{name}'.{did_you_mean(name, [*PARTS, *INSTALLED])} {_known()}")


def _known() -> str:
    return f"The parents are: {', '.join([*PARTS, *INSTALLED])}."


def _imported(path: str) -> type[Part]:
    """Return the class at an import path.

    Raises:
        ParentError: it cannot be imported, or is no `Part`.
    """
    module, _, name = path.rpartition(".")
    try:
        found = getattr(import_module(module), name)
    except (Exception, SystemExit) as error:  # the module runs as it is imported, and may raise anything
        why = str(error).strip() or type(error).__name__
        raise ParentError(f"The parent '{path}' cannot be imported: {why.rstrip('.')}.") from None
    if not (isinstance(found, type) and issubclass(found, Part)):
        raise ParentError(f"'{path}' is not a subclass of parenting.parents.errors.Part.")
    if isabstract(found):
        raise ParentError(f"'{path}' leaves open: {', '.join(sorted(found.__abstractmethods__))}.")
    return found


def _values(kind: type[Part], written: list[str]) -> dict[str, str]:
    names, given = list(kind.model_fields), dict[str, str]()
    for place, one in enumerate(written):
        key, equals, value = (word.strip() for word in one.partition("="))
        if not equals and place == 0 and names:
            key, value = names[0], key
        if key not in names:
            known = f"It has: {', '.join(names)}." if names else "It has none."
            raise ParentError(
                f"{kind.__name__.lower()} has no parameter '{key}'.{did_you_mean(key, names)} {known}"
            )
        if key in given:
            raise ParentError(f"{kind.__name__.lower()}: {key} is given twice.")
        given[key] = value
    return given


def _written(part: Part) -> str:
    text = ",".join(f"{name}={value}" for name, value in part.model_dump().items())
    kind = type(part)
    return f"{_name_of(kind)}:{text}" if text else _name_of(kind)


def _name_of(kind: type[Part]) -> str:
    if PARTS.get(kind.name) is kind:
        return kind.name
    installed = (name for name in INSTALLED if INSTALLED.get(name) is kind)
    return next(installed, f"{kind.__module__}.{kind.__name__}")
