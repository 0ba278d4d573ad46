"""The files of an export, from a folder or a zip: their hashes, and their rows one by one."""

from __future__ import annotations

import hashlib
import io
import json
import zlib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import IO, Any
from zipfile import BadZipFile, ZipFile

from parenting._cells import whole_rows

MANIFEST = "manifest.json"
PIECE = 2**20
BROKEN = (BadZipFile, EOFError, KeyError, OSError, RuntimeError, ValueError, zlib.error)


class Files:
    """The files of an export."""

    def __init__(self, path: Path) -> None:
        """Open an export.

        Raises:
            ValueError: there is none.
        """
        self._zip: ZipFile | None = None
        self._folder, self._named = path, set[str]()
        if not path.is_dir():
            try:
                self._zip = ZipFile(path)
            except (BadZipFile, OSError):
                raise ValueError(f"{path} is neither a folder nor a zip that can be read") from None

    def close(self) -> None:
        """Close it."""
        if self._zip is not None:
            self._zip.close()

    def open(self, name: str) -> IO[bytes]:
        """Open the manifest, or a file that it names.

        Raises:
            ValueError: it does not name this one, so there is no hash of it.
        """
        if name != MANIFEST and name not in self._named:
            raise ValueError(f"{name} is not named in the manifest")
        if self._zip is not None:
            return self._zip.open(name)
        file = (self._folder / name).resolve()
        if not file.is_relative_to(self._folder.resolve()):
            raise ValueError(f"{name} is outside of the folder")
        return file.open("rb")

    def manifest(self) -> dict[str, Any]:
        """Return the manifest.

        Raises:
            ValueError: it is missing, or not of an export of format 2.
        """
        try:
            with self.open(MANIFEST) as file:
                found = json.load(file)
        except BROKEN:
            raise ValueError("manifest.json is missing or cannot be read") from None
        if not isinstance(found, dict) or (found.get("format"), found.get("version")) != (
            "parenting-export",
            2,
        ):
            raise ValueError("it is not an export of Parenting of format 2")
        self._named = set(found["files"])
        return found

    def digest(self, name: str) -> tuple[str, int]:
        """Return the SHA-256 and the bytes of a file."""
        hashed, size = hashlib.sha256(), 0
        with closing(self.open(name)) as file:
            while piece := file.read(PIECE):
                hashed.update(piece)
                size += len(piece)
        return hashed.hexdigest(), size

    def lines(self, name: str) -> Iterator[dict[str, Any]]:
        """Yield the objects of a file of JSON lines."""
        with closing(self.open(name)) as file:
            yield from map(json.loads, filter(bytes.strip, file))

    def cells(self, name: str) -> Iterator[dict[str, str]]:
        """Yield the rows of a CSV file as text.

        Raises:
            ValueError: a row has not a cell for each column.
        """
        with io.TextIOWrapper(self.open(name), encoding="utf-8", newline="") as text:
            yield from whole_rows(text, name)


def unpacked_lines(file: IO[bytes]) -> Iterator[bytes]:
    """Yield the lines of a file that zlib has compressed; a piece of it at a time is in memory."""
    unpack, rest = zlib.decompressobj(), b""
    while packed := unpack.unconsumed_tail or file.read(PIECE):
        *lines, rest = (rest + unpack.decompress(packed, PIECE)).split(b"\n")
        yield from lines
    rest += unpack.flush()
    if not unpack.eof:
        raise ValueError("a compressed file is cut off")
    yield from rest.splitlines()
