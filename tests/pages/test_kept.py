"""The list that is searched; the page of a run's name, tags and files; the page before its deletion."""

from __future__ import annotations

import re

import httpx2

from parenting.server import deletion, keeping
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.pages.run_list import PAGE
from parenting.server.runs import get_run, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run


def begin(db: Database, name: str = "first") -> str:
    return start(db, NewRun(world="unsafe-exploration", name=name)).public_id


def shown(page: httpx2.Response) -> list[str]:
    """The titles of the runs in the list."""
    return re.findall(r"<h2><a [^>]*><bdi>([^<]*)</bdi>", page.text)


def test_the_list_shows_world_level_preset_parent_tags_and_space(client: httpx2.Client, db: Database) -> None:
    begin(db)
    keeping.describe(db, 1, {"tags": ["<pilot>", "b&c"]})
    text = re.sub(r"<[^>]*>", "", client.get("/").text)
    assert "Run 1: Unsafe exploration, island; conservative, raised by you, seed 0" in text.lower().replace(
        "run 1: unsafe", "Run 1: Unsafe"
    )
    assert "&lt;pilot&gt;" in text
    assert "0 bytes · Name, tags, files" in text
    set_status(db, 1, RunStatus.STOPPED)
    ended = re.sub(r"<[^>]*>", "", client.get("/").text)
    assert "0 bytes · Dashboard · Name, tags, files" in ended, "a run that is over has no buttons"


def test_a_search_goes_on_over_its_pages(client: httpx2.Client, db: Database) -> None:
    for number in range(PAGE + 3):
        begin(db, f"kept {number:02}")
    begin(db, "other")
    first = client.get("/", params={"q": "kept", "sort": "name", "tag": "", "world": ""})
    assert shown(first) == [f"kept {number:02}" for number in range(PAGE)]
    (more,) = re.findall(r'href="(/\?[^"]*before=[^"]*)">More runs', first.text)
    second = client.get(more.replace("&amp;", "&"))
    assert shown(second) == [f"kept {number:02}" for number in range(PAGE, PAGE + 3)]
    assert "No run is like this." in client.get("/?q=nothing").text
    assert client.get("/?sort=size").status_code == 422


def test_words_are_kept_or_come_back_with_an_error(client: httpx2.Client, db: Database) -> None:
    page = f"/runs/{begin(db)}/settings"
    assert str(client.get("/runs/1/settings").url).endswith(page)
    form = {"name": "Group A", "tags": " pilot, , week two ", "description": "strict\r\nparent"}
    assert client.post(page, data=form).headers["location"] == page
    run = get_run(db, 1)
    assert (run.name, keeping.split_tags(run.tags), run.description) == (
        "Group A",
        ["pilot", "week two"],
        "strict\nparent",
    )
    wrong = client.post(page, data={**form, "name": "x\u0007", "tags": "y" * 41})
    assert wrong.status_code == 422
    assert {'id="name-error"', 'id="tags-error"'} <= set(re.findall(r'id="\w+-error"', wrong.text))
    assert "y" * 41 in wrong.text
    assert get_run(db, 1).name == "Group A"
    assert client.post(page, data={"name": "Group B"}).status_code == 303
    assert (get_run(db, 1).name, get_run(db, 1).description) == ("Group B", "strict\nparent")
    assert keeping.split_tags(get_run(db, 1).tags) == ["pilot", "week two"]
    for part in ("answers", "metrics", "events"):
        (href,) = re.findall(rf'href="([^"]*of={part}&amp;format=csv)"', wrong.text)
        assert client.get(href.replace("&amp;", "&")).text.startswith("run,")


def test_archived_runs_leave_the_list_and_come_back(client: httpx2.Client, db: Database) -> None:
    page = f"/runs/{begin(db)}/archive"
    assert client.post(page, data={"archived": "true"}).status_code == 303
    listed = client.get("/")
    assert (shown(listed), "Every run is archived." in listed.text) == ([], True)
    assert shown(client.get("/?archived=true")) == ["first"]
    assert client.post(page, data={"archived": "false"}).status_code == 303
    assert shown(client.get("/")) == ["first"]


def test_a_run_is_deleted_where_the_page_was_about_it(client: httpx2.Client, db: Database) -> None:
    name, other = begin(db), begin(db, "second")
    asked = client.get(f"/runs/{name}/delete").text
    assert "<b>0</b> answers to <b>0</b> questions" in asked
    assert f'name="confirm" value="{name}"' in asked
    assert client.post("/runs/1/delete", data={"confirm": other}).status_code == 409
    assert (
        client.post("/runs/1/delete", headers={"Origin": "http://evil"}, data={"confirm": name}).status_code
        == 403
    )
    assert client.post(f"/runs/{name}/delete", data={"confirm": name}).headers["location"] == "/"
    assert client.get(f"/runs/{name}").status_code == 404
    assert shown(client.get("/")) == ["second"]


def test_the_list_goes_on_with_a_deletion_that_was_stopped(client: httpx2.Client, db: Database) -> None:
    name = begin(db)
    deletion.begin(db, 1)
    page = client.get("/").text
    assert "It is being deleted; 0 bytes are left." in page
    assert f'action="/runs/{name}/delete"' in page
    assert client.post(f"/runs/{name}/delete", data={"confirm": name}).status_code == 303
    assert [stone.id for stone in deletion.tombstones(db)] == [1]


def test_a_damaged_run_can_be_deleted(client: httpx2.Client, db: Database) -> None:
    name = begin(db)
    with db.write() as session:
        session.get_one(Run, 1).config = {"stages": "many"}
    assert 'href="/runs/1/delete"' in client.get("/").text
    assert "Run 1" in client.get("/runs/1/delete").text
    assert client.post("/runs/1/delete", data={"confirm": name}).status_code == 303
    assert deletion.tombstones(db)[0].gone is not None
