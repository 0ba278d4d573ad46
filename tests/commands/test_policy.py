"""`parenting policy`: a run's policy as a file."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import parenting as pt
from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import claim
from tests.server.test_policies import saved


@pytest.fixture(autouse=True)
def raised(db: Database) -> None:
    """A run with a checkpoint, and one without."""
    run = start(db, NewRun(world="unsafe-exploration"))
    (mine,) = claim(db, "w")
    saved(db, mine, run, 7)
    start(db, NewRun(world="unsafe-exploration"))


def policy(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["policy", *arguments])


def test_it_writes_a_file_that_loads(tmp_path: Path) -> None:
    file = tmp_path / "careful.safetensors"
    said = policy("1", "--out", str(file))
    assert said.exit_code == 0, said.output
    assert "after tick 7, stage 1" in said.stdout
    assert hashlib.sha256(file.read_bytes()).hexdigest() in said.stdout
    assert pt.load_policy(file).world.name == "unsafe-exploration"
    again = policy("1", "--out", str(file))
    assert (again.exit_code, "exists already" in again.stderr) == (2, True)
    told = json.loads(policy("1", "--out", str(file), "--force", "--json").stdout)
    assert (told["file"], told["source"]["tick"]) == (str(file), 7)


def test_a_run_without_a_checkpoint_is_told_in_a_sentence(tmp_path: Path) -> None:
    said = policy("2", "--out", str(tmp_path / "none.safetensors"))
    assert (said.exit_code, said.stdout) == (2, "")
    assert "no good checkpoint" in said.stderr
    assert list(tmp_path.glob("*.safetensors")) == []
