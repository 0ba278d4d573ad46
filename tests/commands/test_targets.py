"""Output of a command takes the place of a file alone, and of the one that a link names."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import claim
from tests.server.test_policies import saved

pytestmark = pytest.mark.only("sqlite", "a file of PostgreSQL's own tools is begun in the same way")

WRITERS = (
    ["policy", "1", "--out"],
    ["export", "1", "--of", "answers", "--out"],
    ["export", "1", "--format", "2", "--out"],
    ["backup", "--to"],
)


@pytest.fixture(autouse=True)
def raised(db: Database) -> None:
    """A run with a checkpoint."""
    run = start(db, NewRun(world="unsafe-exploration"))
    (mine,) = claim(db, "w")
    saved(db, mine, run, 7)


@pytest.fixture(params=WRITERS, ids=" ".join)
def words(request: pytest.FixtureRequest) -> list[str]:
    """One of the commands that write a file."""
    said: list[str] = request.param
    return said


@pytest.fixture
def ending(words: list[str]) -> str:
    """The ending of a name for what it writes."""
    return ".jsonl" if "--of" in words else ".zip"


@pytest.fixture
def write(words: list[str]) -> Callable[..., Result]:
    """Have it write a file."""

    def call(target: Path, *more: str) -> Result:
        return CliRunner().invoke(app, [*words, str(target), *more])

    return call


def pipe(path: Path) -> None:
    os.mkfifo(path)


def listening(path: Path) -> None:
    """A socket's name outlives its socket; it may not be long."""
    with socket.socket(socket.AF_UNIX) as made, contextlib.chdir(path.parent):
        made.bind(path.name)


@pytest.mark.slow_after(3)
@pytest.mark.parametrize("force", [[], ["--force"]])
@pytest.mark.parametrize("make", [pipe, listening])
def test_what_is_not_a_file_stays(
    write: Callable[..., Result],
    ending: str,
    make: Callable[[Path], None],
    force: list[str],
    tmp_path: Path,
) -> None:
    target, link = tmp_path / f"it{ending}", tmp_path / f"link{ending}"
    make(target)
    link.symlink_to(target)
    kind = stat.S_IFMT(target.stat().st_mode)
    for named in (target, link):
        said = write(named, *force)
        assert (said.exit_code, said.stdout) == (2, "")
        assert said.stderr.startswith(f"{named} is a device, a pipe or a socket, so it is not replaced.")
    assert stat.S_IFMT(target.lstat().st_mode) == kind
    assert link.is_symlink()


def test_a_link_stays_and_the_file_that_it_names_is_written(
    write: Callable[..., Result], ending: str, tmp_path: Path
) -> None:
    (tmp_path / "far").mkdir()
    file, link = tmp_path / "far" / f"it{ending}", tmp_path / f"link{ending}"
    link.symlink_to(file)
    assert write(link).exit_code == 0
    assert (link.is_symlink(), file.is_file()) == (True, True)
    file.write_bytes(b"former")
    refused = write(link)
    assert (refused.exit_code, "exists already" in refused.stderr) == (2, True)
    assert write(link, "--force").exit_code == 0
    assert link.is_symlink()
    assert file.read_bytes() != b"former"
    assert [path.name for path in file.parent.iterdir()] == [f"it{ending}"]


def test_a_link_to_itself_is_told_in_a_sentence(
    write: Callable[..., Result], ending: str, tmp_path: Path
) -> None:
    link = tmp_path / f"link{ending}"
    link.symlink_to(link)
    said = write(link, "--force")
    assert (said.exit_code, said.stderr.count("\n")) == (2, 1)
    assert said.stderr.startswith(f"{link} cannot be written: ")


def test_a_folder_behind_a_link_is_replaced_there(tmp_path: Path) -> None:
    folder, link = tmp_path / "folder", tmp_path / "link"
    link.symlink_to(folder)
    for more in ([], ["--force"]):
        said = CliRunner().invoke(app, ["export", "1", "--out", str(link), *more])
        assert said.exit_code == 0, said.output
        assert link.is_symlink()
        assert (folder / "manifest.json").is_file()
    assert {path.name for path in tmp_path.iterdir()} == {"data", "folder", "link"}
