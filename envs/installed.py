"""Objects that other installed packages bring, by entry point. Nothing here loads torch.

An entry point names an object of a package's module. The package is imported when the object is first asked
for. One that cannot be used is told by a sentence, and ends nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar

Kind = TypeVar("Kind")


class BrokenPackageError(ValueError):
    """An object of an installed package cannot be used; the sentence names the package and the reason."""


class Installed(Generic[Kind]):
    """The objects of one group of entry points, by name."""

    def __init__(self, group: str, what: str, check: Callable[[str, object], Kind]) -> None:
        """Find nothing yet.

        Args:
            group: The group of entry points, such as `parenting.worlds`.
            what: What one of them is called in sentences, such as "world".
            check: Returns the object as it is used; raises a ValueError or TypeError where it is not one.
        """
        self.group, self.what, self.check = group, what, check
        self._points: dict[str, EntryPoint] | None = None
        self._found: dict[str, Kind] = {}
        self._broken: dict[str, str] = {}

    def names(self) -> list[str]:
        """Return the names of all entry points; no package is imported."""
        if self._points is None:
            self._points = {point.name: point for point in entry_points(group=self.group)}
        return list(self._points)

    def get(self, name: str) -> Kind | None:
        """Return the object of a name; None where there is none, or where it cannot be used."""
        if name in self._found or name in self._broken or name not in self.names():
            return self._found.get(name)
        assert self._points is not None
        point = self._points[name]
        try:
            found = self.check(name, _loaded(point))
        except _UnfinishedError:
            return None  # its module is being imported right now: it will be there the next time
        except (Exception, SystemExit) as error:
            self._broken[name] = self._sentence(point, error)
            return None
        return self._found.setdefault(name, found)

    def __iter__(self) -> Iterator[str]:
        """Return the names of those that can be used. Imports their packages."""
        return (name for name in self.names() if self.get(name) is not None)

    def broken(self) -> dict[str, str]:
        """Return a sentence for each one that cannot be used, by its name. Imports the packages of all."""
        list(self)
        return dict(self._broken)

    def refuse(self, name: str) -> None:
        """Tell why the object of a name cannot be used, if it is one of those.

        Raises:
            BrokenPackageError: it cannot be used.
        """
        if self.get(name) is None and name in self._broken:
            raise BrokenPackageError(self._broken[name])

    def _sentence(self, point: EntryPoint, error: BaseException) -> str:
        said = str(error).strip() or type(error).__name__
        said = said if isinstance(error, ValueError | TypeError) else f"{type(error).__name__}: {said}"
        return (
            f"The {self.what} '{point.name}' of the package {_package(point)} cannot be used:"
            f" {said.rstrip('.')}. Repair the package, or uninstall it."
        )


class _UnfinishedError(Exception):
    """The module of an entry point is being imported, and has not come to the object yet."""


def _loaded(point: EntryPoint) -> object:
    module = import_module(point.module)
    try:
        found: object = reduce(getattr, filter(None, (point.attr or "").split(".")), module)
    except AttributeError:
        if getattr(module.__spec__, "_initializing", False):
            raise _UnfinishedError from None
        raise
    return found


def _package(point: EntryPoint) -> str:
    return point.value if point.dist is None else f"{point.dist.name} {point.dist.version}"
