"""Files that only their owner can read, whatever the mode of the folder around them."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from parenting.server.store import high_water
from parenting.server.store.held import index_of, log_of

OTHERS = 0o077


def make_files_private() -> None:
    """Let every file and socket that this process makes be its owner's alone."""
    os.umask(OTHERS)


def close_to_others(database: Path) -> None:
    """Take from others the right to read a database that this user owns, and the files beside it.

    An older version, or another umask, may have left it to them.
    """
    for path in (database, log_of(database), index_of(database), high_water.mark_of(database)):
        try:
            found = path.stat()
            if found.st_uid == os.geteuid() and stat.S_IMODE(found.st_mode) & OTHERS:
                path.chmod(stat.S_IMODE(found.st_mode) & ~OTHERS)
        except OSError:
            continue  # it is not there, or its file system has no such rights
