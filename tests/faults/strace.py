"""The writes and syncs of processes as strace saw them: what went to which file, and what was synced when.

The processes are recorded as they are; nothing is linked into them.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

CALLS = "write,pwrite64,fsync,fdatasync,ftruncate,fallocate,unlink,unlinkat,rename,renameat2"
LONGEST = 1 << 20
"""Bytes of one write that strace prints; a longer one fails."""
_CALL = re.compile(r"(\d+) +(?:([\w?]+)\((.*)|<\.\.\. ([\w?]+) resumed>(.*))")
"""A call, or its end. strace names a call `???` if the process was killed before its registers were read."""
_FILE = re.compile(r"\d+<([^>]*)>")
_HEX = re.compile(r'"((?:\\x[0-9a-f]{2})*)"(\.\.\.)?')
UNFINISHED = " <unfinished ...>"


class Call(NamedTuple):
    """A system call on a file that changed or synced it, from its first line in the trace to its last."""

    name: str  # write, sync, truncate
    file: str
    began: int
    ended: int
    offset: int = -1  # where it wrote; -1 is the end of the file
    data: bytes = b""
    size: int = 0  # what it truncated to


def program() -> str:
    """The path of strace. Without it a laptop skips the test, and CI fails it."""
    found = shutil.which("strace")
    if found:
        return found
    reason = "no strace: install it (apt install strace)"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


def recorded(trace: Path, *command: str) -> list[str]:
    """The command line that records a command and all that it starts."""
    options = ["-f", "-qq", "--seccomp-bpf", "-y", "-xx", "-s", str(LONGEST), "-e", f"trace={CALLS}"]
    return [program(), *options, "-e", "signal=none", "-o", str(trace), *command]


def calls(trace: Path, files: Sequence[Path]) -> Iterator[Call]:
    """The calls on these files in the order of their ends; failed ones changed nothing."""
    wanted = {str(file) for file in files}
    open_calls: dict[str, tuple[str, str, int]] = {}
    with trace.open(encoding="ascii") as lines:
        for number, line in enumerate(lines):
            match = _CALL.match(line)
            assert match, line[:200]
            process, name, rest, resumed, end = match.groups()
            began = number
            if resumed:
                name, rest, began = open_calls.pop(process)
                rest += end
            elif rest.rstrip().endswith(UNFINISHED.strip()):
                open_calls[process] = (name, rest.rstrip().removesuffix(UNFINISHED.strip()).rstrip(), began)
                continue
            found = _read(name, rest, began, number)
            if found is not None and found.file in wanted:
                yield found


def _read(name: str, rest: str, began: int, ended: int) -> Call | None:
    arguments, _, result = rest.rpartition(" = ")
    if result.startswith(("-1", "?")):
        return None
    if name in ("unlink", "unlinkat", "rename", "renameat2"):
        return None if "-shm" in _plain(arguments) else _named(name, arguments, began, ended)
    opened = _FILE.match(arguments)
    if opened is None:
        return None
    file = _plain(opened[1])
    if name in ("fsync", "fdatasync"):
        return Call("sync", file, began, ended)
    if name == "ftruncate":
        return Call("truncate", file, began, ended, size=int(arguments.rstrip(" )").rpartition(",")[2]))
    data = _HEX.search(arguments, opened.end())
    assert data is not None, arguments[:200]
    assert data[2] is None, f"a write of more than {LONGEST} bytes"
    offset = int(arguments.rstrip(" )").rpartition(",")[2]) if name == "pwrite64" else -1
    return Call("write", file, began, ended, offset, _bytes(data[1])[: int(result.split()[0])])


def _named(name: str, arguments: str, began: int, ended: int) -> Call | None:
    """A call by a path; the files of the database are neither removed nor renamed while it is recorded."""
    path = _HEX.search(arguments)
    return Call(name, _bytes(path[1]).decode(), began, ended) if path else None


def _bytes(text: str) -> bytes:
    return bytes.fromhex(text.replace("\\x", ""))


def _plain(text: str) -> str:
    """A path that strace printed in hexadecimal digits, wholly or not at all."""
    return _bytes(text).decode() if text.startswith("\\x") else text
