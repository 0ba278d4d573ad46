"""`parenting worlds`: what it prints, for people and for programs."""

import json

import pytest
import typer
from typer.testing import CliRunner

from commands.worlds import worlds
from envs import registry

app = typer.Typer()
app.command()(worlds)


def output(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.mark.parametrize("world", registry.WORLDS)
def test_every_level_is_drawn(world: str) -> None:
    shown = output()
    kind = registry.kind(world)
    assert f"{world}: {kind.title}" in shown
    assert kind.brief.danger in shown
    for name in kind.levels:
        art = "\n".join(f"    {row}" for row in registry.level(world, name).rows)
        assert f"  {name}{' (default)' if name == kind.default else ''}\n{art}\n" in shown


def test_json_holds_levels_that_can_be_read_back() -> None:
    shown = json.loads(output("--json"))
    assert [world["name"] for world in shown["worlds"]] == list(registry.WORLDS)
    for world in shown["worlds"]:
        assert list(world["legend"].values())[:2] == ["wall", "land"]
        for level in world["levels"]:
            parsed = registry.level(world["name"], level["text"])
            assert (parsed.name, list(parsed.rows)) == (level["name"], level["rows"])
