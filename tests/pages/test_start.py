"""The first page: the list and the form."""

from __future__ import annotations

import json
import re
from pathlib import Path

import httpx2
import pytest

from parenting.agent.config import offered_preset
from parenting.envs import registry
from parenting.envs.registry import WORLDS
from parenting.server.db import Database
from parenting.server.new_run import NewRun, plan, start
from parenting.server.pages.levels import beginning
from parenting.server.pages.options import OPTIONS, Option
from parenting.server.pages.run_list import PAGE
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.run_form import read_form
from parenting.server.runs import get_run, let_go, list_runs, set_goal, set_status
from parenting.server.statuses import RunStatus
from tests.pages import island_fixtures as fixtures
from tests.pages.parent_page import address

FORM = {
    "world": "unsafe-exploration",
    "level": "island",
    "level_text": "",
    "parent": "human",
    "preset": "conservative",
    "seed": "7",
}


def test_a_new_installation_has_one_picture_and_one_button_and_then_the_form(
    client: httpx2.Client, db: Database
) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert 'class="runs"' not in page.text
    button, form = page.text.index("Raise your first agent</button>"), page.text.index('class="fields"')
    assert page.text.count("<img ") == 1
    assert page.text.index("<img ") < button < form
    assert page.text.count('class="primary"') == 2  # this one, and the form's own
    width, height = re.findall(r'<img [^>]*width="(\d+)" height="(\d+)"', page.text)[0]
    assert f'width="{width}" height="{height}"' in client.get("/static/question.svg").text
    presets = re.findall(r'name="preset" value="(\w+)"( checked)?', page.text)[1:]  # behind the button's own
    assert presets == [("frugal", " checked"), ("conservative", ""), ("lax", ""), ("direct", "")]


def test_the_button_of_a_new_installation_starts_the_default_run(client: httpx2.Client, db: Database) -> None:
    welcome = client.get("/").text.partition('class="welcome"')[2].partition("</section>")[0]
    fields = dict(re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)">', welcome))
    reply = client.post("/runs", data=fields)
    assert (reply.status_code, reply.headers["location"]) == (303, address(db))
    run, default = get_run(db, 1), NewRun(world="unsafe-exploration", parent="human")
    assert (run.world, run.level, run.parent) == ("unsafe-exploration", "island", "human")
    assert (run.preset, run.seed, run.goal) == ("frugal", default.seed, None)
    assert 'class="welcome"' not in client.get("/").text


def test_each_world_offers_the_preset_that_is_no_worse_there(client: httpx2.Client) -> None:
    page = client.get("/").text
    offered = dict(re.findall(r'<option value="([\w-]+)" data-preset="(\w+)"', page))
    assert offered == {world: offered_preset(world) for world in WORLDS}


@pytest.mark.parametrize("world", ["side-effects", "absent-supervisor"])
def test_a_level_that_was_drawn_comes_with_the_preset_of_its_world(client: httpx2.Client, world: str) -> None:
    drawn = {"world": world, "level_text": beginning(registry.level(world))}
    page = client.post("/levels/start", data=drawn).text
    assert re.findall(r'name="preset" value="(\w+)" checked', page) == [offered_preset(world)]
    chosen = client.post("/levels/start", data={**drawn, "preset": "lax"}).text
    assert re.findall(r'name="preset" value="(\w+)" checked', chosen) == ["lax"]


def test_a_wrong_field_brings_the_form_back_without_the_welcome(client: httpx2.Client) -> None:
    page = client.post("/runs", data={**FORM, "seed": "many"}).text
    assert 'class="welcome"' not in page
    assert '<h1 id="new-title">Start a run</h1>' in page


def test_the_cost_of_a_large_level_is_told_before_the_start(client: httpx2.Client) -> None:
    rows = ["W" * 62, "WA" + " " * 58 + "GW", *["W" + " " * 60 + "W"] * 59, "W" * 62]
    for text, told in (("\n".join(rows), True), ("WWWWW\nWA GW\nWWWWW", False)):
        found = client.post("/api/v1/levels/check", json={"world": "unsafe-exploration", "text": text}).json()
        assert found["valid"]
        assert ("On this level a tick takes" in (found["cost"] or "")) == told


def test_a_run_of_mine_begins_at_the_parents_page(client: httpx2.Client, db: Database) -> None:
    reply = client.post("/runs", data=FORM)
    assert (reply.status_code, reply.headers["location"]) == (303, address(db))
    run = get_run(db, 1)
    assert (run.level, run.preset, run.seed, run.parent) == ("island", "conservative", 7, "human")
    assert run.config["p_guid"] == 0.95


def test_a_scripted_run_begins_at_the_dashboard(client: httpx2.Client, db: Database) -> None:
    there = client.post("/runs", data={**FORM, "parent": "scripted"}).headers["location"]
    assert there == f"/runs/{get_run(db, 1).public_id}"


def test_a_level_of_ones_own_stands_in_for_the_list(client: httpx2.Client, db: Database) -> None:
    assert client.post("/runs", data={**FORM, "level_text": "#####\r\n#A G#\r\n#####\r\n"}).status_code == 303
    assert "#A G#" in get_run(db, 1).level_text


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("seed", "many", "whole number"),
        ("seed", "-1", "from 0 to"),
        ("level", "atlantis", "There is no such level"),
        ("level_text", "#####\n#A?G#\n#####\n", "line 2, column 3"),
        ("world", "moon", "There is no such world"),
        ("preset", "stern", "There is no such preset"),
        ("parent", "nobody", "human"),
    ],
)
def test_an_error_stands_beside_its_field_and_what_was_typed_stays(
    client: httpx2.Client, db: Database, field: str, value: str, message: str
) -> None:
    page = client.post("/runs", data={**FORM, field: value})
    assert page.status_code == 422
    error = page.text.partition(f'id="{field}-error">')[2].partition("</p>")[0]
    assert message in error
    assert not list_runs(db)
    if field in ("seed", "level_text"):
        assert f'aria-invalid="true" aria-describedby="{field}-error' in page.text
        assert value.split("\n")[0] in page.text
    else:
        assert 'value="7"' in page.text


def test_every_wrong_field_is_named_at_once(client: httpx2.Client) -> None:
    wrong = {"preset": "stern", "level": "atlantis", "seed": "many"}
    page = client.post("/runs", data={**FORM, **wrong})
    assert re.findall(r'class="error" id="(\w+)-error"', page.text) == ["level", "preset", "seed"]
    assert page.text.count(" autofocus") == 1


def test_what_was_typed_is_escaped(client: httpx2.Client) -> None:
    page = client.post("/runs", data={**FORM, "level_text": "</textarea><script>alert(1)</script>"})
    assert "<script>alert" not in page.text
    assert "&lt;/textarea&gt;&lt;script&gt;" in page.text


def test_a_stranger_field_is_no_crash(client: httpx2.Client) -> None:
    assert client.post("/runs", data={"seed": ["1", "2"], "x": "y"}).status_code == 422


def test_the_list_says_where_every_run_is(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db, name="<b>Bold</b>")
    fixtures.measure(db, mine, 50)
    report_progress(db, mine, optimal=True)
    fixtures.start_run(db, parent="scripted")
    page = client.get("/").text
    assert "&lt;b&gt;Bold&lt;/b&gt;" in page
    assert "<dt>Tick</dt><dd>50</dd>" in page
    assert "<dt>Deaths</dt><dd>3</dd>" in page
    assert ">optimal<" in page
    assert f'href="{address(db)}"' in page
    assert f'href="{address(db, 2)}"' not in page  # a script raises it
    assert f'href="/runs/{get_run(db, 2).public_id}"' in page


def test_the_settings_of_the_form_are_the_runs(client: httpx2.Client, db: Database) -> None:
    given = {"world": "absent-supervisor", "level": "supervisor", "config.supervised": "random"}
    assert client.post("/runs", data={**FORM, **given, "config.pretrain": ""}).status_code == 303
    first = get_run(db, 1)
    assert (first.config["supervised"], first.config["pretrain"]) == ("random", True)
    assert first.weights is not None
    given = {
        "world": "reward-hacking",
        "level": "garden",
        "config.inside": "left",
        "config.pretrain": "false",
    }
    assert client.post("/runs", data={**FORM, **given}).status_code == 303
    second = get_run(db, 2)
    assert (second.config["inside"], second.config["pretrain"], second.weights) == ("left", False, None)


@pytest.mark.parametrize("option", [one for one in OPTIONS if one.choices], ids=lambda one: one.field)
def test_each_choice_of_a_setting_is_one_that_a_run_takes(option: Option, tmp_path: Path) -> None:
    world = next(name for name in reversed(list(WORLDS)) if option.needs in {"", *WORLDS[name].legend})
    empty = plan(read_form({**FORM, "world": world, "level": ""}), tmp_path)
    for value, name in option.choices:
        taken = plan(read_form({**FORM, "world": world, "level": "", option.field: value}), tmp_path)
        where = taken["config"] if option.field.startswith("config.") else taken
        held = where[option.field.removeprefix("config.")]
        assert json.dumps(held).strip('"') == value if value else taken == empty, name


def test_a_size_without_weights_is_refused_with_an_offer(client: httpx2.Client, db: Database) -> None:
    given = {**FORM, "world": "side-effects", "level": "box", "level_text": "#####\n#AXG#\n#   #\n#####"}
    page = client.post("/runs", data=given)
    assert page.status_code == 422
    error = page.text.partition('class="offer"')[2].partition("</p>")[0]
    assert "no weights made beforehand for Side Effects on levels of 4 × 5." in error
    assert "Pre-train now (about 10 s)</button>" in page.text
    assert not list_runs(db)
    assert client.post("/runs", data={**given, "config.pretrain": "false"}).status_code == 303


def test_goal_pace_and_stages(client: httpx2.Client, db: Database) -> None:
    given = {"goal": "50", "pace": "2.5", "config.stages": "3", "config.mature_every": "20"}
    assert client.post("/runs", data={**FORM, **given}).status_code == 303
    run = get_run(db, 1)
    assert (run.goal, run.pace) == (50, 2.5)
    assert (run.config["stages"], run.config["mature_every"]) == (3, 20)
    page = client.get("/").text
    assert "<dt>Stage</dt><dd>1 <small>of 3</small>" in page
    assert "<dt>Answered</dt><dd>0 <small>of 50</small>" in page


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("goal", "0"),
        ("goal", "some"),
        ("pace", "-1"),
        ("script", "noisy:2"),
        ("config.stages", "17"),
        ("config.mature_every", "x"),
        ("config.gradient_steps", "0"),
    ],
)
def test_a_wrong_number_among_the_settings(client: httpx2.Client, field: str, value: str) -> None:
    page = client.post("/runs", data={**FORM, "parent": "scripted", field: value})
    assert page.status_code == 422
    said = page.text.partition(f'id="{field}-error">')[2].partition("</p>")[0]
    assert said.endswith(".")
    assert "Input should" not in said
    assert f'value="{value}"' in page.text
    assert ('<details class="more" open>' in page.text) == (field != "goal")


def test_hundreds_of_runs_are_listed_page_by_page(client: httpx2.Client, db: Database) -> None:
    for seed in range(2 * PAGE + 5):
        set_status(db, start(db, NewRun(world="unsafe-exploration", seed=seed)).id, RunStatus.STOPPED)
    seen, path = [], "/"
    while path:
        page = client.get(path).text
        seen.append([int(number) for number in re.findall(r", run (\d+)</bdi></a></h2>", page)])
        older = re.search(r'href="([^"]*)">Older runs', page)
        path = older[1] if older else ""
    assert [len(part) for part in seen] == [PAGE, PAGE, 5]
    assert [number for part in seen for number in part] == list(range(2 * PAGE + 5, 0, -1))
    assert ">Newest</a>" in page
    for wrong in ("0", "x", "-1"):
        assert client.get(f"/?before={wrong}").status_code == 422


def test_the_list_says_who_waits_for_whom(client: httpx2.Client, db: Database) -> None:
    def chips() -> list[str]:
        return re.findall(r'<span class="chip[^"]*">([^<]*)</span>', client.get("/").text)

    _, mine = fixtures.start_run(db)
    assert chips() == ["exploring"]
    report_progress(db, mine, waiting="stuck")
    assert chips() == ["no action acceptable"]
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down"))
    assert chips() == ["a question waits"]
    set_status(db, 1, RunStatus.PAUSED)
    assert chips() == ["paused"]
    set_status(db, 1, RunStatus.ACTIVE)
    set_goal(db, 1, 1)
    answer(db, query, "left", "me", "human")
    assert chips() == ["goal reached"]
    set_goal(db, 1, None)
    let_go(db, [mine])
    assert chips() == ["no worker"]
    set_status(db, 1, RunStatus.STOPPED)
    assert chips() == ["stopped"]


def test_every_world_names_its_glyphs(client: httpx2.Client) -> None:
    hint = client.get("/").text.partition('id="level_text-hint"')[2].partition("</p>")[0]
    for kind in WORLDS.values():
        of_world = hint.partition(f'data-world="{kind.name}"')[2].partition("</span>")[0]
        for glyph, tile in kind.legend.items():
            assert glyph == " " or f"<code>{glyph}</code> {tile}" in of_world
    assert hint.count("<code>cycle:</code>") == 1


def test_hints_keep_the_names_of_worlds(client: httpx2.Client) -> None:
    assert "fewest answers in Unsafe Exploration and Side Effects." in client.get("/").text
