"""Worlds from tables of transition probabilities: what is read, kept, and refused."""

from __future__ import annotations

import base64
import math
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from pydantic import ValidationError

import parenting as pt
from parenting.agent.config import compose
from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.envs.tables.text import unpack
from parenting.parents.value_iteration import optimal
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, plan
from tests.tree import ROOT

Table = dict[int, dict[int, list[tuple[float, int, float, bool]]]]


def still(states: int) -> Table:
    """A table in which no move leads anywhere."""
    return {state: {action: [(1.0, state, 0.0, False)] for action in range(4)} for state in range(states)}


def line(**changes: Any) -> pt.TableWorld:
    """Four cells in a row; right leads on, and the last one is the goal."""
    table = still(4)
    for state in range(3):
        table[state][3] = [(1.0, state + 1, float(state == 2), state == 2)]
    return pt.TableWorld(table, **{"shape": (1, 4), "goal": {3}, "name": "line", **changes})


def test_a_level_holds_the_whole_world() -> None:
    """No process has to know its name: the text of the level says all."""
    text = line().level.text
    assert "line" not in registry.WORLDS
    world = world_of("line", text, compose("conservative", {}, {}, strict=True))
    assert world.spec.legend == {"#": "wall", " ": "land", "G": "goal", "A": "agent"}
    assert registry.level("line", text).rows == ("######", "#A  G#", "######")
    planned = plan(NewRun(world="line", level_text=text))
    assert (planned["level_text"], planned["brief"]["goal"]) == (text, "The agent should walk to the goal.")


def test_the_same_table_gives_the_same_text_and_another_one_another_text() -> None:
    assert line().level.text == line().level.text != line(unsafe={2}).level.text


def test_an_episode_may_begin_at_another_state() -> None:
    moved = line().level.text.replace("#A  G#", "# A G#")
    assert registry.make("line", moved).beginnings().agent.tolist() == [[1, 2]]
    with pytest.raises(pt.LevelError, match="no episode can begin here"):
        registry.level("line", line().level.text.replace("#A  G#", "#   A#"))
    with pytest.raises(pt.LevelError, match=r"line 6, column 3: the table has ' ' here"):
        registry.level("line", line().level.text.replace("#A  G#", "#A# G#"))


def test_states_beyond_position_become_layers() -> None:
    """A key: eight states on four cells; down at the second cell leads from one layer into the other."""
    table = still(8)
    for state in (0, 1, 2, 4, 5, 6):
        table[state][3] = [(1.0, state + 1, 0.0, state in (2, 6))]
        table[state + 1][2] = [(1.0, state, 0.0, False)]
    table[1][1] = [(1.0, 5, 0.0, False)]
    marked = pt.TableWorld(table, shape=(1, 4), goal={3, 7}, name="key")
    assert [layer.rows[2] for layer in marked.table.layers] == ["0#####", "1#####"]
    assert marked.table.legend["1"] == "layer 1"
    tiles = {0: [" k  "], 1: ["    "]}
    drawn = pt.TableWorld(table, (1, 4), tiles=tiles, goal={3, 7}, name="key", legend={"k": "key"})
    assert [layer.rows[1] for layer in drawn.table.layers] == ["# k G#", "#   G#"]
    assert drawn.table.legend["k"] == "key"
    assert pt.train(drawn, preset="frugal", seed=1, progress=False).trials[0]["optimal"]


def test_values_are_means_over_what_chance_brings() -> None:
    """Right ends with 1/2 at the goal and stays with 1/2: V = (1/2) / (1 - gamma / 2)."""
    table = still(2)
    table[0][3] = [(0.5, 1, 1.0, True), (0.25, 0, 0.0, False), (0.25, 0, 0.0, False)]
    world = pt.make(pt.TableWorld(table, shape=(1, 2), goal={1}))
    model = explore(world)
    assert model.branch_chance[0, 3].tolist() == [0.5, 0.5]
    v = optimal(model, 0.9).v
    assert v[0].item() == pytest.approx(0.5 / (1 - 0.45))


def all_moves(outcome: tuple[float, int, float, bool]) -> Table:
    return {0: {action: [outcome] for action in range(4)}}


def moved(*outcomes: Any) -> pt.TableWorld:
    """A world of two states, as a list, with these outcomes of the first move."""
    table = [[[(1.0, state, 0.0, False)] for _ in range(4)] for state in range(2)]
    table[0][0] = list(outcomes)
    return pt.TableWorld(table, shape=(1, 2))  # type: ignore[arg-type]  # as people write it


def sometimes() -> Table:
    return {0: {action: [(1.0, 1, 0.0, action < 2)] for action in range(4)}}


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: line(name="Frozen Lake"), "name: 'Frozen Lake'"),
        (lambda: line(place=lambda state: (state, 0, 0)), "place: state 1 is at row 1, column 0, beyond"),
        (lambda: line(tiles=["    ", "    "]), "tiles: 1 rows of 4 glyphs"),
        (lambda: line(tiles=[" #  "]), "state 1 is at a wall"),
        (lambda: line(start=9), r"P\[9\]\[0\] is missing"),
        (lambda: line(place=lambda state: (0, 0, 0)), "look alike"),
        (lambda: pt.TableWorld(all_moves((0.5, 1, 0.0, True)), (1, 2)), "sum to 0.5, not to 1"),
        (lambda: moved((math.nan, 0, 0.0, False), (1.0, 1, 0.0, False)), r"P\[0\]\[0\]: nan is not a prob"),
        (lambda: moved((-0.5, 0, 0.0, False), (1.5, 1, 0.0, False)), "-0.5 is not a probability"),
        (lambda: moved((1.0, -1, 0.0, False)), "leads to state -1"),
        (lambda: moved((1.0, 0.5, 0.0, False)), "leads to state 0.5"),
        (lambda: moved((1.0, 1, math.inf, False)), "inf is not a reward"),
        (lambda: moved((1.0, 1)), r"\(1.0, 1\) is not \(probability, next state, reward"),
        (lambda: pt.TableWorld([[[(1.0, 0, 0.0, False)]] * 4], (1, 1), start=-1), "start: -1 is not a state"),  # type: ignore[arg-type]  # as people write it
        (lambda: pt.TableWorld(still(2), (0, 2)), "shape: 0 x 2 is not from 1 x 1 to 64 x 64"),
        (lambda: pt.TableWorld(still(2), (10**9, 10**9)), "shape: 1000000000 x 1000000000"),
        (lambda: pt.TableWorld({**sometimes(), 1: still(2)[1]}, (1, 2)), "ends an episode by some moves"),
        (lambda: pt.TableWorld({0: {a: [(1, 1, 0, True)] for a in range(6)}}, (1, 2)), "6 actions.*then="),
    ],
)
def test_what_is_wrong_is_named(made: Callable[[], Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        made()


@pytest.mark.parametrize(
    "spoilt",
    [
        "AAAA",
        "not base64",
        base64.b64encode(zlib.compress(b"{}")).decode(),
        base64.b64encode(zlib.compress(b"0" * 2**25)).decode(),
        base64.b64encode(zlib.compress(b'{"title": "x"')).decode(),
    ],
)
def test_a_spoilt_table_is_refused_with_a_sentence(spoilt: str) -> None:
    with pytest.raises(ValueError, match=r"^the table (cannot be unpacked|is not sound|is cut off)"):
        unpack(spoilt)
    text = f"world: line\nname: start\ntable: {spoilt}\n\n######\n#A  G#\n######\n"
    with pytest.raises((InvalidFieldsError, ValidationError)):
        plan(NewRun(world="line", level_text=text))
    with pytest.raises(pt.LevelError):
        world_of("line", text, compose("conservative", {}, {}, strict=True))


def test_a_stored_policy_finds_its_world_again(tmp_path: Path) -> None:
    policy = pt.train(line(), until="ticks:3", progress=False, seed=1).policies[0]
    policy.save(tmp_path / "line.safetensors")
    again = pt.load_policy(tmp_path / "line.safetensors")
    assert torch.equal(again.parameters, policy.parameters)
    assert pt.evaluate(again, episodes=2).length > 0


def test_no_part_of_it_needs_torch() -> None:
    """The web process imports packages that make such worlds."""
    code = """
import sys, gymnasium, parenting as pt
lake = pt.TableWorld.from_toy_text(gymnasium.make("FrozenLake-v1"))
assert lake.level.rows[1] == "#A   #"
assert "torch" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
