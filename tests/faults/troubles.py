"""Troubles of a store that last for a while, each as a block: a disk that is full, a lock that is held."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import psycopg
import pytest
from pysqlite3 import dbapi2 as sqlite

from tests.postgres import Cluster, programs

DISK_BYTES = 32 * 2**20
QUOTA_BYTES = 24 * 2**20
IMAGE_BYTES = 400 * 2**20
"""The image of the file system with a quota; it takes as much as is written into it."""
WRITABLE_BYTES = 32 * 2**10
"""Less than the log of a database has at any time."""
REFILL_SECONDS = 0.05


def _run(*command: str) -> str | None:
    """Run a command of the machine; None if it went well, else why not."""
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        return f"{command[0]} is not installed"
    return (done.stderr.strip() or f"{command[0]} ended with {done.returncode}") if done.returncode else None


def _need(*command: str) -> None:
    """Run a command that only root may run, on machines that can do it; else skip the test."""
    if os.geteuid() != 0:
        pytest.skip("only root may mount file systems and make files immutable")
    if (why := _run(*command)) is not None:
        pytest.skip(f"this machine cannot do it: {' '.join(command[:3])}: {why}")


@contextmanager
def small_disk() -> Iterator[Path]:
    """A file system of 32 MB, in memory."""
    with tempfile.TemporaryDirectory() as folder:
        _need("mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", folder)
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def folder_with_quota() -> Iterator[Path]:
    """A folder that may hold 24 MB: a subvolume of btrfs with a limit, on an image. It says EDQUOT.

    Whoever writes to a page of a file that is mapped into memory is ended by SIGBUS instead.
    """
    with tempfile.TemporaryDirectory() as name:
        image, mounted = Path(name) / "image", Path(name) / "mounted"
        mounted.mkdir()
        with image.open("wb") as file:
            file.truncate(IMAGE_BYTES)
        _need("mkfs.btrfs", "--quiet", str(image))
        _need("mount", "-o", "loop,commit=1", str(image), str(mounted))
        try:
            folder = mounted / "folder"
            _need("btrfs", "quota", "enable", str(mounted))
            _need("btrfs", "subvolume", "create", str(folder))
            _need("btrfs", "qgroup", "limit", str(QUOTA_BYTES), str(folder))
            yield folder
        finally:
            subprocess.run(["umount", "--lazy", str(mounted)], check=True)


@contextmanager
def immutable(folder: Path) -> Iterator[None]:
    """Make a folder and its files read-only, for root and for open files too.

    The index of the log (-shm) is left out: processes that share it in memory would end by SIGBUS.
    """
    files = [str(file) for file in folder.iterdir() if not file.name.endswith("-shm")]
    _need("chattr", "+i", *files, str(folder))
    try:
        yield
    finally:
        subprocess.run(["chattr", "-i", str(folder), *files], check=True)


@contextmanager
def filled(folder: Path) -> Iterator[None]:
    """Fill the file system, and fill again whatever is freed, as a program that runs wild does."""
    told, filler = threading.Event(), folder / "filler"

    def fill() -> None:
        with filler.open("ab", buffering=0) as file:
            while not told.wait(REFILL_SECONDS):
                for size in (2**20, 2**12):
                    with suppress(OSError):
                        while not told.is_set() and file.write(b"\0" * size) == size:
                            pass

    thread = threading.Thread(target=fill, daemon=True)
    thread.start()
    try:
        yield
    finally:
        told.set()
        thread.join()
        filler.unlink()
        os.sync()  # btrfs counts what was freed at its next commit


@contextmanager
def files_bounded(pids: Sequence[int]) -> Iterator[None]:
    """Let processes write no byte of a file beyond 32 kB (`ulimit -f`): they get EFBIG."""
    before = {pid: resource.prlimit(pid, resource.RLIMIT_FSIZE) for pid in pids}
    for pid, (_, hard) in before.items():
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (WRITABLE_BYTES, hard))
    try:
        yield
    finally:
        for pid, limits in before.items():
            resource.prlimit(pid, resource.RLIMIT_FSIZE, limits)


@contextmanager
def lock_of_another(where: Path | str) -> Iterator[None]:
    """Hold the database's write lock, as another program would; on PostgreSQL all tables, for readers too."""
    if isinstance(where, Path):
        with closing(sqlite.connect(where, isolation_level=None, timeout=60)) as held:
            held.execute("BEGIN IMMEDIATE")
            yield
            held.execute("ROLLBACK")
        return
    with psycopg.connect(where) as connection:
        _lock_tables(connection)
        yield
        connection.rollback()


def _lock_tables(connection: psycopg.Connection[tuple[Any, ...]]) -> None:
    """Lock one table after the other; who holds one of them and waits for another makes a deadlock of it.

    PostgreSQL then ends either transaction. Ours is begun again; the processes under test must do the same.
    """
    while True:
        try:
            connection.execute("LOCK TABLE run, query, answer IN ACCESS EXCLUSIVE MODE")
            return
        except psycopg.errors.DeadlockDetected:
            connection.rollback()


def _children(pid: int) -> list[int]:
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _send(pids: Sequence[int], number: signal.Signals) -> None:
    """Send a signal to processes, of which some may have ended."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, number)


class Restarting(Cluster):
    """A PostgreSQL of its own that can be stopped and started again."""

    @contextmanager
    def stopped(self, mode: str) -> Iterator[None]:
        """Stop it as pg_ctl does by this mode, and start it again at the end: *immediate* is a crash."""
        self.admin.close()
        stop = [*self.user, str(programs() / "pg_ctl"), "-D", str(self.folder), "-m", mode, "stop"]
        subprocess.run(stop, check=True, capture_output=True, cwd=self.folder)
        yield
        self._ended.append(self.process)
        self.process = self._start()
        self.admin = self._connected()

    @contextmanager
    def without(self, name: str, rng: random.Random) -> Iterator[None]:
        """End a connection of the process of this name, as an administrator may."""
        self.admin.execute("SELECT pg_terminate_backend(%s)", [self._backend_of(name, rng)])
        yield

    @contextmanager
    def crashed(self, name: str, rng: random.Random) -> Iterator[None]:
        """Kill the process behind a connection: the server ends all others, recovers and begins again."""
        os.kill(self._backend_of(name, rng), signal.SIGKILL)
        self.admin.close()
        yield
        self.admin = self._connected()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Stop all its processes without ending them (SIGSTOP), and let them go on at the end."""
        first = int((self.folder / "postmaster.pid").read_text().split()[0])
        os.kill(first, signal.SIGSTOP)  # so that it starts no others
        found = [first, *_children(first)]
        _send(found, signal.SIGSTOP)
        try:
            yield
        finally:
            _send(found, signal.SIGCONT)

    def _backend_of(self, name: str, rng: random.Random) -> int:
        """One of a process's connections; a process has one at least, for what it listens to."""
        rows = "SELECT pid FROM pg_stat_activity WHERE application_name = %s ORDER BY pid"
        end = time.monotonic() + 60
        while not (found := self.admin.execute(rows, [name]).fetchall()):
            assert time.monotonic() < end, f"{name} does not connect"
            time.sleep(0.01)
        return int(rng.choice(found)[0])

    def __init__(self) -> None:
        self._ended: list[subprocess.Popen[bytes]] = []
        super().__init__()

    def stop(self) -> None:
        """Stop it at once and remove its folder."""
        super().stop()
        for guard in self._ended:
            guard.communicate()
        shutil.rmtree(self.folder, ignore_errors=True)
