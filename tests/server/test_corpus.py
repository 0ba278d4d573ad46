"""Every version's data opens in this one, exports the same values, and is replayed to the same bits.

`scripts/corpus.py` makes and checks the data. The check runs in a process of its own, because torch chooses
its vector instructions when it is loaded, and other instructions give other bits.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import structlog
import torch
from fastapi.testclient import TestClient

from parenting.audit import audit
from parenting.server import runs
from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.export import lines
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
from scripts import corpus
from tests.access import seed
from tests.tree import ROOT

FOLDERS = sorted(
    (file.parent for file in (ROOT / "tests" / "old").glob("*/data.tar.xz")),
    key=lambda folder: [int(part) for part in folder.name.split(".")],
)
PINNED = [folder for folder in FOLDERS if folder.name != "0.1.0"]
"""Version 0.1.0 did not pin its instructions; tests/server/test_old_data.py checks its bits."""
EXPORTED = [folder for folder in PINNED if (folder / corpus.EXPORT).is_file()]
"""Those with an export of whole runs (format 2), which is imported, and replayed too."""
REPLAYED = [
    pytest.param(
        folder,
        id=folder.name,
        marks=pytest.mark.faults if folder in (PINNED[0], PINNED[-1]) else pytest.mark.slow,
    )
    for folder in PINNED
]
"""The data of the oldest and of the last version are replayed by `make faults`, all others by `make slow`."""
PAGES = ("/runs/{}", "/runs/{}/parent", "/runs/{}/history", "/api/v1/runs/{}/queries")


def names(folder: Path) -> str:
    return folder.name


@pytest.fixture(params=FOLDERS, ids=names)
def settings(request: pytest.FixtureRequest, tmp_path: Path) -> Settings:
    with tarfile.open(request.param / "data.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    seed(tmp_path / "data")
    return Settings(data=tmp_path / "data", database_url=None)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = connect(settings)
    upgrade(database)
    yield database
    database.close()


def test_there_is_one_of_each_version_that_was_published() -> None:
    assert [folder.name for folder in FOLDERS][:2] == ["0.1.0", "0.2.0"]


def test_every_version_since_0_7_has_an_export_that_holds() -> None:
    assert [folder.name for folder in EXPORTED][:2] == ["0.7.0", "0.8.0"]
    for folder in EXPORTED:
        assert audit(folder / corpus.EXPORT).problems == []


@pytest.mark.slow_after(1)
def test_its_pages_open(db: Database, settings: Settings) -> None:
    with TestClient(create_app(settings, db), base_url="http://localhost") as client:
        for run in runs.list_runs(db):
            for path in PAGES:
                page = client.get(path.format(run.id), follow_redirects=True)
                assert page.status_code == 200, page.text


def test_its_exports_have_the_old_values(db: Database, settings: Settings) -> None:
    for run in runs.list_runs(db):
        old = (settings.data / f"run-{run.id}.jsonl").read_text(encoding="utf-8").splitlines()
        assert len(old) == run.answers > 0
        for line, before in zip(lines(db, run.id), old, strict=True):
            row, former = json.loads(line), json.loads(before)
            assert {name: row[name] for name in former} == former


@pytest.mark.parametrize("folder", REPLAYED)
def test_it_is_replayed_and_goes_on_with_the_bits_of_its_version(folder: Path) -> None:
    expected = json.loads((folder / "expected.json").read_text(encoding="utf-8"))
    if expected["made"]["torch"] != torch.__version__:
        pytest.skip(f"the data was written with torch {expected['made']['torch']}")
    found = checked(folder, expected["made"]["cpu"])
    assert found["replays"] == expected["replays"]
    assert found["goes_on"] == expected["goes_on"]
    assert min(found["imported"].values()) >= 8, "its tables of answers are runs again"
    assert found["exported"] == (
        {"1": [18, None], "2": [16, None], "3": [4, None]} if folder in EXPORTED else {}
    )
    assert {replay["parted"] for replay in found["replays"].values()} == {None}


def test_lines_of_the_log_are_not_part_of_what_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slow machine makes some, such as of a store that is waited for."""
    logged = structlog.get_config()
    structlog.reset_defaults()  # a test before may have configured another level

    def check(_folder: Path) -> dict[str, int]:
        structlog.get_logger().warning("a line")
        return {"found": 1}

    monkeypatch.setattr(corpus, "check", check)
    monkeypatch.setattr(sys, "argv", ["corpus", "check", str(tmp_path)])
    monkeypatch.setenv("ATEN_CPU_CAPABILITY", corpus.CAPABILITY)
    threads = torch.get_num_threads()
    try:
        corpus.main()
    finally:
        structlog.configure(**logged)
        torch.set_num_threads(threads)
    told = capsys.readouterr()
    assert json.loads(told.out) == {"found": 1}
    assert "a line" in told.err


@pytest.mark.slow
def test_other_instructions_are_refused() -> None:
    done = subprocess.run(command(FOLDERS[-1]), env=environment("avx2"), capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == "Set ATEN_CPU_CAPABILITY=default: other instructions give other bits.\n"


def test_data_that_is_there_is_never_written_again() -> None:
    with pytest.raises(FileExistsError):
        corpus.make(FOLDERS[-1])


def checked(folder: Path, capability: str) -> dict[str, Any]:
    """The result of this version for a folder's data under these instructions."""
    done = subprocess.run(command(folder), env=environment(capability), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def command(folder: Path) -> list[str]:
    return [sys.executable, "-m", "scripts.corpus", "check", str(folder)]


def environment(capability: str) -> dict[str, str]:
    return {**os.environ, "ATEN_CPU_CAPABILITY": capability, "PYTHONPATH": str(ROOT)}
