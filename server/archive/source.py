"""Read an export of format 2 from a folder or a zip; every file is held against its hash before."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast
from zipfile import BadZipFile, ZipFile

from pydantic import TypeAdapter, ValidationError

from parenting._cells import whole_rows
from parenting.server.archive.columns import Column, Row
from parenting.server.archive.import_names import REMEDY
from parenting.server.archive.import_rules import ROWS, first_of, shown, wrong_value
from parenting.server.archive.manifest import Manifest
from parenting.server.archive.target import MANIFEST
from parenting.server.errors import SetupError
from parenting.weights.answers_export import UNREADABLE

LARGEST_MANIFEST = 64 * 2**20
"""Bytes of a manifest that are read at most."""
LARGEST_BLOB = 2 * 2**30
"""Bytes of a checkpoint, or of what a run began with, that are read at most."""
PIECE = 2**20
Progress = Callable[[int, int], None]


class Source:
    """An export that is being read; its files are sound once `verify` has returned."""

    def __init__(self, path: Path, opened: Callable[[str], IO[bytes]]) -> None:
        self._path, self._opened = path, opened
        with self.open(MANIFEST) as file:
            blob = file.read(LARGEST_MANIFEST + 1)
        self.manifest = self._read_manifest(blob)
        self.sha256 = hashlib.sha256(blob).hexdigest()

    @contextmanager
    def open(self, name: str) -> Iterator[IO[bytes]]:
        """Open a file of the export.

        Raises:
            SetupError: it is missing, or cannot be read.
        """
        try:
            with self._opened(name) as file:
                yield file
        except UNREADABLE:
            raise SetupError(f"{self._path}: {name} is missing or cannot be read.") from None

    def verify(self, progress: Progress = lambda done, total: None) -> None:
        """Compare every file with its hash in the manifest.

        Raises:
            SetupError: one differs or is missing.
        """
        done, total = 0, sum(entry.bytes for entry in self.manifest.files.values())
        for name, entry in self.manifest.files.items():
            digest, size = hashlib.sha256(), 0
            with self.open(name) as file:
                while size <= entry.bytes and (piece := file.read(PIECE)):
                    digest.update(piece)
                    size += len(piece)
                    progress(done + size, total)
            done += size
            if (digest.hexdigest(), size) != (entry.sha256, entry.bytes):
                raise SetupError(
                    f"{self._path}: {name} is not the file that was written: its hash differs from the "
                    "manifest's. Nothing was imported. Take another copy of the export."
                )

    def blob(self, name: str) -> bytes:
        """Return the bytes of a file.

        Raises:
            SetupError: the manifest does not name it, or it is too large.
        """
        entry = self.manifest.files.get(name)
        if entry is None or entry.bytes > LARGEST_BLOB:
            raise SetupError(f"{self._path}: {name} is not in the manifest, or too large.")
        with self.open(name) as file:
            return file.read(entry.bytes)

    def rows(self, name: str, model: type[Row], columns: list[Column]) -> Iterator[Any]:
        """Yield the rows of a table.

        Raises:
            SetupError: the manifest does not name it, or a row is not as its columns say, or was damaged in
                the database that it is of.
        """
        if name not in self.manifest.files:
            raise SetupError(f"{self._path}: {name} is not in the manifest, so there is no hash of it.")
        with self.open(name) as file:
            read: Iterable[str | bytes] = _csv_lines(file, columns) if name.endswith(".csv") else file
            try:
                for number, line in enumerate(read, start=1):
                    place = f"{self._path}: {name}: row {number}"
                    if line.strip():
                        yield _row(model, name, line, place)
            except csv.Error as error:
                raise SetupError(f"{self._path}: {name}: a row cannot be read: {error}. {REMEDY}") from None
            except ValueError as error:
                raise SetupError(f"{self._path}: {name}: {error}. {REMEDY}") from None

    def _read_manifest(self, blob: bytes) -> Manifest:
        try:
            found = json.loads(blob) if len(blob) <= LARGEST_MANIFEST else None
            if not isinstance(found, dict) or found.get("format") != "parenting-export":
                raise SetupError(f"{self._path} is not an export of Parenting of format 2.")
            version = found.get("version")
            if isinstance(version, int) and version > 2:
                raise SetupError(
                    f"{self._path} is an export of format {version}, which is newer than this version of "
                    "Parenting. Install a newer one."
                )
            if version != 2:
                raise SetupError(f"{self._path}: {MANIFEST}: version: {version!r} is not 2.")
            return Manifest.model_validate(found)
        except (ValueError, RecursionError) as error:
            raise SetupError(f"{self._path}: {MANIFEST} cannot be read: {_said(error)}.") from None


@contextmanager
def source(path: Path) -> Iterator[Source]:
    """Open an export.

    Raises:
        SetupError: it is none, or damaged.
    """
    if path.is_dir():
        yield Source(path, lambda name: _inside(path, name))
        return
    try:
        with ZipFile(path) as zipped:
            yield Source(path, lambda name: zipped.open(name))
    except (BadZipFile, OSError):
        raise SetupError(f"{path} is neither a folder nor a zip of an export, or is damaged.") from None


def _inside(folder: Path, name: str) -> IO[bytes]:
    file = (folder / name).resolve()
    if not file.is_relative_to(folder.resolve()):
        raise KeyError(name)
    return file.open("rb")


def _row(model: type[Row], name: str, line: str | bytes, place: str) -> Row:
    """Return a row of a table.

    Raises:
        SetupError: a value is missing, of a wrong type or against a rule, or was damaged in its database.
    """
    try:
        row: Any = model.model_validate_json(line)
    except ValidationError as error:
        raise SetupError(f"{place}: {first_of(error)}. {REMEDY}") from None
    if row.damaged is not None:
        raise SetupError(f"{place} was damaged in its database: {row.damaged}. Nothing was imported.")
    if (wrong := wrong_value(ROWS[name], dict(row))) is not None:
        raise SetupError(f"{place}: {shown(*wrong)}. {REMEDY}")
    return cast(Row, row.at(place))


def _csv_lines(file: IO[bytes], columns: list[Column]) -> Iterator[str]:
    """Yield the rows of a CSV file as JSON."""
    kinds = {column.name: column.type for column in columns}
    with io.TextIOWrapper(file, encoding="utf-8", newline="") as text:
        for cells in whole_rows(text):
            yield json.dumps({name: _value(kinds.get(name, str), cell) for name, cell in cells.items()})


def _value(kind: type, cell: str) -> Any:
    if cell == "":
        return None
    try:
        return cell if kind is str else _JSON.validate_json(cell)
    except ValidationError:
        return cell  # which the row's model refuses with its place


def _said(error: Exception) -> str:
    return first_of(error) if isinstance(error, ValidationError) else type(error).__name__


_JSON: TypeAdapter[Any] = TypeAdapter(int | float | bool)
