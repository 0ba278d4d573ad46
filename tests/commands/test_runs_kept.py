"""The commands below `parenting runs`, and its list as it is searched."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner, Result

from parenting.commands import runs_delete
from parenting.commands.main import app
from parenting.server import deletion
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run


@pytest.fixture(autouse=True)
def two(db: Database) -> None:
    """Two runs."""
    for name in ("first", "second"):
        start(db, NewRun(world="unsafe-exploration", name=name))


def runs(*arguments: str, answer: str | None = None) -> Result:
    return CliRunner().invoke(app, ["runs", *arguments], input=answer)


def listed(*arguments: str) -> list[int]:
    return [run["id"] for run in json.loads(runs(*arguments, "--json").stdout)]


@pytest.mark.slow
def test_words_are_kept_and_found(db: Database) -> None:
    assert runs("rename", "1", "Group A").stdout == "Run 1 is called Group A.\n"
    assert runs("describe", "2", "told to be strict").exit_code == 0
    assert runs("tag", "1", "pilot", "week two").stdout == "Tags of run 1: pilot, week two.\n"
    assert runs("tag", "1", "--remove", "pilot").stdout == "Tags of run 1: week two.\n"
    assert listed("--tag", "week two") == listed("--search", "group") == [1]
    assert listed("--search", "strict") == [2]
    assert listed("--sort", "oldest") == [1, 2]
    assert "week two" in runs().stdout
    assert runs("rename", "1", "").stdout == "Run 1 has no name of its own.\n"
    assert runs("archive", "1").exit_code == 0
    assert (listed(), listed("--all")) == ([2], [2, 1])
    assert runs("archive", "1", "--undo").exit_code == 0
    assert listed() == [2, 1]
    assert runs("--search", "nothing").stdout.startswith("No run is like this.")


def test_deleting_says_what_it_holds_and_asks(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    refused = runs("delete", "1")
    assert (refused.exit_code, "Give --yes" in refused.stderr) == (2, True)
    monkeypatch.setattr(runs_delete, "_asks", lambda: True)
    kept = runs("delete", "1", answer="n\n")
    assert (kept.exit_code, kept.stdout.endswith("Run 1 is not deleted.\n")) == (1, True)
    assert "Run 1 holds 0 answers, 0 questions, 0 checkpoints, 0 rows, 0 events: 0 bytes." in kept.stderr
    assert get_run(db, 1).deleting is None
    assert runs("delete", "1", answer="y\n").stdout.endswith("Run 1 is deleted: 0 bytes.\n")
    assert listed("--all") == [2]
    assert runs("deleted").stdout.startswith(
        f"Run 1 ({deletion.tombstones(db)[0].public_id}): unsafe-exploration"
    )
    assert [one["run"] for one in json.loads(runs("deleted", "--json").stdout)] == [1]


def test_a_deletion_that_was_stopped_goes_on_unasked(db: Database) -> None:
    deletion.begin(db, 2)
    assert "being deleted" in runs().stdout
    assert runs("delete", "2").exit_code == 0
    assert listed("--all") == [1]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("rename", "9", "x"), "There is no run 9."),
        (("rename", "1", "\u200b"), "NAME: nothing of this can be seen"),
        (("describe", "1", "x" * 2001), "TEXT: at most 2000 characters"),
        (("tag", "1", "a,b"), "TAGS: a comma"),
        (("delete", "9", "--yes"), "There is no run 9."),
        (("--sort", "size"), "'size' is not one of"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(arguments: tuple[str, ...], part: str) -> None:
    said = runs(*arguments)
    assert (said.exit_code, part in said.stderr) == (2, True), said.output
