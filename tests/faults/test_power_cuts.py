"""A power cut at any instant loses no told answer (A1), and leaves a database that is whole.

Web, worker and parents run as they are under strace, which records each write and sync. Images are what a
disk may hold after a cut: all that was synced, and any sectors of the rest. Where `synchronous` is NORMAL or
OFF, the same images must show losses; otherwise they would show nothing.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from pysqlite3 import dbapi2 as sqlite

from parenting.server.new_run import start
from parenting.server.settings import Settings
from tests.database import migrated
from tests.faults.auditor import Store, audit
from tests.faults.figures import Figures
from tests.faults.ledger import Entries, told_in
from tests.faults.power import Image, images
from tests.faults.strace import Call, calls, recorded
from tests.lengths import length
from tests.server.raising import ISLAND
from tests.tree import ROOT

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 20000))]
IMAGES = {"full": length(300, 50_000), "normal": 60, "off": 60}
ANSWERS = length(40, 400)
RECORDING_SECONDS = length(600, 6000)
"""A machine with other work needs several times as long as one without."""


class Recording:
    """A recorded house: the files that it began with, and every call that changed or synced them."""

    def __init__(self, settings: Settings, level: str) -> None:
        db = migrated(settings)
        for _ in range(2):
            start(db, ISLAND.new("human"))
        db.close()
        self.database = settings.data / "parenting.db"
        self.log, self.ledger = self.database.with_name("parenting.db-wal"), settings.data / "ledger"
        assert not self.log.exists()
        self.start = {str(self.database): self.database.read_bytes()}
        trace = settings.data / "trace"
        command = [
            sys.executable,
            "-m",
            "tests.faults.recorded_house",
            str(settings.data),
            str(ANSWERS),
            level,
        ]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        traced = recorded(trace, *command)
        subprocess.run(traced, cwd=ROOT, env=environment, check=True, timeout=RECORDING_SECONDS)
        everything = list(calls(trace, [self.database, self.log, self.ledger]))
        self.calls = [call for call in everything if call.file != str(self.ledger)]
        self.told = [call for call in everything if call.file == str(self.ledger) and call.name == "write"]

    def instants(self, number: int, rng: random.Random) -> list[int]:
        """Lines of the recording: half of them right after a client was told something."""
        first, last = self.told[0].ended, self.calls[-1].ended
        soon = [rng.choice(self.told).ended for _ in range(number // 2)]
        return soon + [rng.randint(first, last) for _ in range(number - len(soon))]

    def told_by(self, instant: int) -> Entries:
        """The promises that clients had been given by then."""
        return told_in(b"".join(call.data for call in self.told if call.ended <= instant))


@pytest.fixture(params=["full", "normal", pytest.param("off", marks=pytest.mark.slow)])
def level(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


@pytest.mark.only("sqlite", "PostgreSQL's own log is its developers' to test")
def test_power_cuts(settings: Settings, level: str, rng: random.Random, figures: Figures) -> None:
    recording = Recording(settings, level)
    assert len(recording.told) >= ANSWERS
    lost = 0
    for image in images(recording.start, recording.calls, recording.instants(IMAGES[level], rng), rng):
        found = breaches(settings.data / "image", image, recording)
        if level == "full":
            assert found == [], f"after line {image.instant} of {settings.data / 'trace'}"
        lost += bool(found)
        figures.count(f"power cuts, synchronous={level}", "images with a loss" if found else "images without")
    assert (lost > 0) == (level != "full"), f"{lost} of {IMAGES[level]} images of {level} show a loss"


def breaches(folder: Path, image: Image, recording: Recording) -> list[str]:
    """Let SQLite recover the files, as it does at the next start, and audit them."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, content in image.files.items():
        (folder / Path(name).name).write_bytes(content)
    file = folder / recording.database.name
    try:
        with closing(sqlite.connect(str(file), isolation_level=None)) as connection:
            connection.execute("PRAGMA synchronous=off")
            connection.execute("SELECT count(*) FROM answer").fetchall()
        return audit(Store(file), recording.told_by(image.instant))
    except sqlite.DatabaseError as error:
        return [f"D1 {error}"]


def test_an_image_holds_what_was_synced_and_any_sectors_of_the_rest() -> None:
    old, new = b"a" * 2048, b"b" * 2048
    written = Call("write", "f", 1, 1, 0, new)
    rng = random.Random(3)
    seen = {image.files["f"] for _ in range(200) for image in images({"f": old}, [written], [2], rng)}
    assert {old, new} <= seen
    assert any(content not in (old, new) for content in seen)
    assert all({content[at : at + 512] for at in (0, 512)} <= {old[:512], new[:512]} for content in seen)
    synced = [written, Call("sync", "f", 2, 3)]
    assert {image.files["f"] for image in images({"f": old}, synced, [4], rng)} == {new}
    overlapping = [written._replace(began=1, ended=3), Call("sync", "f", 2, 4)]
    late = {image.files["f"] for _ in range(50) for image in images({"f": old}, overlapping, [5], rng)}
    assert old in late, "a sync reaches only what was written before it began"


def test_a_call_that_strace_could_not_name_is_passed_over(tmp_path: Path) -> None:
    """A process that is killed leaves such lines."""
    trace, file = tmp_path / "trace", tmp_path / "ledger"
    lines = [
        f'7 write(3<{file}>, "\\x61", 1) = 1',
        "8 ???( <detached ...>",
        "9 ???() = ?",
        f"10 fsync(3<{file}> <unfinished ...>",
        f'7 write(3<{file}>, "\\x62", 1 <detached ...>',
        "10 <... ??? resumed>) = ?",
    ]
    trace.write_text("\n".join(lines) + "\n")
    assert [(call.name, call.data) for call in calls(trace, [file])] == [("write", b"a")]
