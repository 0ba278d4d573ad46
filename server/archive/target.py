"""The folder or the zip that an export is written to: it has its name once it is whole, or never."""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import IO, Any, NamedTuple, cast
from zipfile import ZIP_DEFLATED, ZipFile

from parenting.server.backups.whole import behind_links, file_at, whole
from parenting.server.errors import SetupError

MANIFEST = "manifest.json"


class Written(NamedTuple):
    """A file of an export."""

    sha256: str
    bytes: int


class Files(ABC):
    """The files of an export that is being written."""

    def __init__(self, scratch: Path) -> None:
        self.scratch = scratch  # a folder on the same disk, for files without a name
        self.written: dict[str, Written] = {}

    @contextmanager
    def open(self, name: str) -> Iterator[IO[bytes]]:
        """Begin a file; at its end its hash is known. One is open at a time."""
        with self._raw(name) as raw:
            hashing = _Hashing(raw)
            yield cast(IO[bytes], hashing)
        self.written[name] = Written(hashing.hash.hexdigest(), hashing.size)

    @abstractmethod
    def _raw(self, name: str) -> AbstractContextManager[IO[bytes]]:
        """Open a file of this name for writing."""


class FolderFiles(Files):
    """Files in a folder."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.folder = folder

    @contextmanager
    def _raw(self, name: str) -> Iterator[IO[bytes]]:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())


class ZipFiles(Files):
    """Files in a zip, which is written from its beginning to its end."""

    def __init__(self, zipped: ZipFile, scratch: Path) -> None:
        super().__init__(scratch)
        self.zipped = zipped

    @contextmanager
    def _raw(self, name: str) -> Iterator[IO[bytes]]:
        with self.zipped.open(name, "w", force_zip64=True) as file:
            yield file


class _Hashing(io.RawIOBase):
    """A file that is only written to, and hashed."""

    def __init__(self, file: IO[bytes]) -> None:
        self.file, self.hash, self.size = file, hashlib.sha256(), 0

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        blob = bytes(data)
        self.hash.update(blob)
        self.size += len(blob)
        self.file.write(blob)
        return len(blob)

    def tell(self) -> int:
        return self.size

    def close(self) -> None:
        """Leave the file open: whoever opened it closes it."""


@contextmanager
def target(path: Path, force: bool = False) -> Iterator[Files]:
    """Begin an export at a path: a zip if it ends with .zip, else a folder.

    Raises:
        SetupError: it exists and `force` is not given, is something else, or cannot be written.
    """
    if path.suffix.lower() == ".zip":
        path = file_at(path)
        _sweep(path)
        with whole(path, force) as part, ZipFile(part, "w", ZIP_DEFLATED) as zipped:
            yield ZipFiles(zipped, part.parent)
        return
    with folder_target(path, force) as part:
        yield FolderFiles(part)


@contextmanager
def zip_in(file: IO[bytes], scratch: Path) -> Iterator[Files]:
    """Write an export as a zip into a file that is open; other files without a name lie in `scratch`."""
    with ZipFile(file, "w", ZIP_DEFLATED) as zipped:
        yield ZipFiles(zipped, scratch)


@contextmanager
def folder_target(path: Path, force: bool = False) -> Iterator[Path]:
    """Begin a folder under a hidden name; it gets its own once it is whole. Links to it stay.

    Raises:
        SetupError: as `target`.
    """
    path = behind_links(path)
    _sweep(path)
    _refuse(path, force)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.mkdir(parents=True, mode=0o700)
        yield part
        if path.exists():
            old = path.with_name(f".{path.name}.{os.getpid()}.old.part")
            path.rename(old)
            part.rename(path)
            shutil.rmtree(old)
        else:
            part.rename(path)
    except OSError as error:
        raise SetupError(f"{path} cannot be written: {error.strerror}. Name another folder.") from None
    finally:
        with suppress(OSError):
            shutil.rmtree(part)


def _refuse(path: Path, force: bool) -> None:
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return
    if not path.is_dir():
        raise SetupError(f"{path} is a file. Name a folder, or a file that ends with .zip.")
    if not force:
        raise SetupError(f"{path} exists already. Name another folder, or give --force to replace it.")
    if not (path / MANIFEST).is_file():
        raise SetupError(f"{path} holds something else than an export, so it is not replaced. Name another.")


def _sweep(path: Path) -> None:
    """Remove what exports to this path have left whose processes were killed."""
    of_ours = re.compile(rf"\.{re.escape(path.name)}\.(\d+)(\.old)?\.part")
    with suppress(OSError):
        for left in path.parent.iterdir():
            found = of_ours.fullmatch(left.name)
            if found and not _lives(int(found[1])):
                shutil.rmtree(left) if left.is_dir() else left.unlink()


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
