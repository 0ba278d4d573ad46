"""Files that root makes in the data folder of another user: they belong to that user, as the folder does.

Root gives commands there, such as `parenting backup`, while a service of systemd runs as a user of its own.
Files of root's would lock that service out.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path

from parenting.server.errors import SetupError


def give(*made: Path) -> None:
    """Give what root has made to the owner of the folder that it is in; other users give nothing.

    Where the right to give is missing it stays root's, which `parenting doctor` tells.

    Args:
        made: Files and folders; a folder comes before what is in it.
    """
    if os.geteuid() == 0 and hasattr(os, "O_PATH"):
        for path in made:
            with suppress(OSError):
                _give(path)


def _give(path: Path) -> None:
    """Give one, by a descriptor that opens nothing: no lock of SQLite's is lost, and no link is followed."""
    folder = path.parent.stat()
    if folder.st_uid == 0:
        return
    descriptor = os.open(path, os.O_PATH | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        found = os.fstat(descriptor)
        # A file with a second name may be one of root's elsewhere, that somebody has linked here.
        if found.st_uid == 0 and (stat.S_ISDIR(found.st_mode) or found.st_nlink == 1):
            os.chown(f"/proc/self/fd/{descriptor}", folder.st_uid, folder.st_gid)
    finally:
        os.close(descriptor)


def exists(path: Path) -> bool:
    """Return whether something is at a path.

    Raises:
        SetupError: this user may not look into its folder.
    """
    try:
        return path.exists()
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise SetupError(f"{path} cannot be used: {error.strerror}. Give a shorter one.") from None
        folder = path.parent
        raise SetupError(
            f"{folder} cannot be looked into: {error.strerror}. Give it to this user: "
            f"chown {os.geteuid()} {folder}"
        ) from None


def way_in(path: Path) -> str:
    """Return the remedy for what this user cannot write."""
    if os.statvfs(path).f_flag & os.ST_RDONLY:
        return "Its file system is read-only: mount it for writing, or set PARENTING_DATA to another folder."
    if path.stat().st_uid == os.geteuid():
        return f"chmod u+rw{'x' if path.is_dir() else ''} {path}"
    return f"Give it to this user: chown {os.geteuid()} {path}"
