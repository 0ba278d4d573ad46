"""`parenting parents`: each parent with its parameters, as `--parent` takes them."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.parents.errors import PARTS
from parenting.parents.grammar import read_parent


def listed(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["parents", *arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_each_parent_stands_there_with_its_parameters() -> None:
    lines = listed().splitlines()
    assert [line.partition(":")[0] for line in lines if not line.startswith(" ")] == [*PARTS]
    assert "hasty: Answers now and then before looking: left or right by a coin." in lines
    assert "    side=left  left or right." in lines


def test_what_is_listed_can_be_written() -> None:
    for part in json.loads(listed("--json")):
        values = ",".join(f"{one['name']}={one['default']}" for one in part["parameters"])
        text = f"{part['name']}:{values}" if values else part["name"]
        assert str(read_parent(text)) == text
