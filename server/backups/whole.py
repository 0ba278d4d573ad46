"""A file that has its name only once it is whole and on the disk, and never replaces another one unasked."""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from parenting.server.errors import SetupError
from parenting.server.store.owner import exists

SPARE_BYTES = 8 * 1024 * 1024
"""Room that must be left on the disk beside a copy."""


@contextmanager
def whole(target: Path, force: bool = False) -> Iterator[Path]:
    """Yield the path of an empty file of the owner's, which takes the name `target` at the end.

    If an error comes before, nothing is left of it. Where `target` is a link, the file that it names is
    written.

    Raises:
        SetupError: `target` exists and `force` is not given, is not a file, or cannot be written.
    """
    target = file_at(target)
    if exists(target) and not force:
        raise _exists(target)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        yield part
        _sync(part)
        _name(part, target, force)
        _sync(target.parent)
    except OSError as error:
        raise SetupError(f"{target} cannot be written: {error.strerror}. Name another file.") from None
    finally:
        for left in (part, Path(f"{part}-journal"), Path(f"{part}-wal"), Path(f"{part}-shm")):
            with suppress(OSError):
                left.unlink(missing_ok=True)


def file_at(target: Path) -> Path:
    """Return the file that a path names, which need not be there: where it is a link, what that names.

    Raises:
        SetupError: something else is there, such as a folder or a pipe, or it cannot be looked at.
    """
    found = target
    try:
        found = behind_links(target)
        kind = found.stat().st_mode
    except FileNotFoundError:
        return found
    except OSError as error:
        raise SetupError(f"{target} cannot be written: {error.strerror}. Name another file.") from None
    if stat.S_ISDIR(kind):
        raise SetupError(f"{target} is a folder. Name a file in it.")
    if not stat.S_ISREG(kind):
        raise SetupError(f"{target} is a device, a pipe or a socket, so it is not replaced. Name a file.")
    return found


def behind_links(path: Path) -> Path:
    """Return what a link names at its end, there or not; every other path as it is."""
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def require_room(folder: Path, needed: int, remedy: str) -> None:
    """Refuse to begin what the disk has no room for.

    Args:
        folder: A folder on that disk; it need not exist yet.
        needed: The bytes that will be written.
        remedy: A sentence.

    Raises:
        SetupError: the disk lacks room.
    """
    there = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    free = shutil.disk_usage(there).free
    if free < needed + SPARE_BYTES:
        lacking = (needed + SPARE_BYTES - free) / 1e6
        raise SetupError(
            f"The disk of {folder} has {free / 1e6:.0f} MB free; {lacking:.0f} MB more are needed. {remedy}"
        )


def size(database: Path) -> int:
    """Return the bytes of a database with its log."""
    return sum(file.stat().st_size for file in (database, Path(f"{database}-wal")) if file.exists())


def _name(part: Path, target: Path, force: bool) -> None:
    if force:
        part.replace(target)
        return
    try:
        os.link(part, target)  # unlike a renaming, it never replaces a file that came meanwhile
    except FileExistsError:
        raise _exists(target) from None
    except OSError:  # a file system without links
        part.rename(target)


def _exists(target: Path) -> SetupError:
    return SetupError(f"{target} exists already. Name another file, or give --force to replace it.")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
