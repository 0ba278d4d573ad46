"""An export as a zip for a browser: written to a file without a name first, then sent as fast as it is read.

A slow reader would otherwise hold the snapshot of the database, and with it the log, for as long as it reads.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from parenting.server.archive.target import zip_in
from parenting.server.archive.writing import write_export
from parenting.server.db import Database

PIECE = 2**18
"""Bytes that are sent at once."""


def zipped(db: Database, runs: Sequence[int], folder: Path) -> Iterator[bytes]:
    """Return the pieces of an export of these runs.

    Args:
        db: The database.
        runs: The runs.
        folder: The folder in which files without a name lie meanwhile.

    Raises:
        NotFound: a run does not exist; raised here, not at the first piece.
        DamagedRowError: its row cannot be read; likewise.
    """
    file: IO[bytes] = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - the reply closes it
    try:
        with zip_in(file, folder) as files:
            write_export(db, runs, files)
        file.seek(0)
    except BaseException:
        file.close()
        raise
    return _pieces(file)


def _pieces(file: IO[bytes]) -> Iterator[bytes]:
    with file:
        while piece := file.read(PIECE):
            yield piece
