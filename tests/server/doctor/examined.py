"""The findings of `parenting doctor`, as a program reads them."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from parenting.commands.main import app


def examined(*arguments: str) -> tuple[int, dict[str, dict[str, str]]]:
    """The exit code, and each finding by its name."""
    done = CliRunner().invoke(app, ["doctor", "--json", *arguments])
    assert isinstance(done.exception, SystemExit | None), done.exception
    return done.exit_code, {row["name"]: row for row in json.loads(done.stdout)}


def states(found: dict[str, dict[str, str]]) -> dict[str, str]:
    """Those that are not in order."""
    return {name: row["state"] for name, row in found.items() if row["state"] != "ok"}
