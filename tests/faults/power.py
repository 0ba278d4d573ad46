"""Power cuts: the files that a disk may hold if the power fails at an instant of a recording.

A disk holds what was synced, and of everything written since any sectors (of 512 bytes), in any order. The
names of files are taken as they are: the recordings neither remove nor rename any.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tests.faults.strace import Call

SECTOR = 512


class Image(NamedTuple):
    """The files after a power cut that came right after a line of the recording."""

    instant: int
    files: dict[str, bytes]


class Disk:
    """The synced bytes of some files, and the writes that no sync has reached yet."""

    def __init__(self, files: dict[str, bytes]) -> None:
        self.synced = {name: bytearray(content) for name, content in files.items()}
        self.pending: list[Call] = []

    def feed(self, call: Call) -> None:
        """Take note of a call that has ended."""
        if call.name != "sync":
            assert call.name in ("write", "truncate"), f"{call.name} of {call.file} while it was recorded"
            self.pending.append(call)
            return
        reached = [one for one in self.pending if one.file == call.file and one.ended < call.began]
        for one in reached:
            change(self.synced.setdefault(one.file, bytearray()), one)
        self.pending = [one for one in self.pending if one not in reached]

    def cut(self, rng: random.Random) -> dict[str, bytes]:
        """The files after a power cut now: each sector that waits is there or not."""
        files = {name: bytearray(content) for name, content in self.synced.items()}
        chance = rng.choice((0.0, 0.1, 0.5, 0.9, 1.0))
        for call in self.pending:
            content = files.setdefault(call.file, bytearray())
            if call.name == "truncate":
                if rng.random() < chance:
                    change(content, call)
                continue
            for sector in sectors(call):
                if rng.random() < chance:
                    change(content, sector)
        return {name: bytes(content) for name, content in files.items()}


def sectors(call: Call) -> Iterator[Call]:
    """A write in pieces that end where sectors do."""
    at, end = call.offset, call.offset + len(call.data)
    while at < end:
        until = min(end, (at // SECTOR + 1) * SECTOR)
        yield call._replace(offset=at, data=call.data[at - call.offset : until - call.offset])
        at = until


def change(content: bytearray, call: Call) -> None:
    """Write into a file, or cut it off."""
    if call.name == "truncate":
        del content[call.size :]
        content.extend(bytes(call.size - len(content)))
        return
    if call.offset > len(content):
        content.extend(bytes(call.offset - len(content)))
    content[call.offset : call.offset + len(call.data)] = call.data


def images(
    start: dict[str, bytes], recording: Sequence[Call], instants: Sequence[int], rng: random.Random
) -> Iterator[Image]:
    """The files after a power cut at each of these lines of a recording that began with `start`."""
    disk, wanted = Disk(start), sorted(instants)
    for call in recording:
        while wanted and wanted[0] < call.ended:
            yield Image(wanted[0], disk.cut(rng))
            wanted.pop(0)
        disk.feed(call)
    yield from (Image(instant, disk.cut(rng)) for instant in wanted)
