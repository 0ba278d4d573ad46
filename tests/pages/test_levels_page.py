"""The editor of levels: painted by mouse, finger and keys, checked by the server, and begun a run on."""

from __future__ import annotations

import json
import re
from pathlib import Path

import httpx2
import pytest
from playwright.sync_api import Page, expect

from parenting.commands.level_file import chosen_level
from parenting.envs import registry
from parenting.envs.levels.spec import LevelError
from parenting.server.db import Database
from parenting.server.runs import get_run
from tests.pages.axe import violated
from tests.pages.browser_tabs import BrowserTabs

WORLD = "unsafe-exploration"
POND = "#####\n#A  #\n# WG#\n#####\n"
WRONG = "#####\n#A Q#\n# WG#\n#####\n"


def text_of(page: Page) -> str:
    return page.locator("#level_text").input_value()


def open_text(page: Page, text: str | bytes) -> None:
    blob = text.encode() if isinstance(text, str) else text
    page.locator("#file").set_input_files({"name": "pond.txt", "mimeType": "text/plain", "buffer": blob})


def at(page: Page, row: int, column: int) -> tuple[float, float]:
    box = page.locator(f"[data-at='{row} {column}']").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.fixture
def pond(tabs: BrowserTabs) -> Page:
    page = tabs.open("/levels", viewport={"width": 1280, "height": 900}, accept_downloads=True)
    expect(page.locator("#told")).to_have_text("This level keeps every rule of Unsafe Exploration.")
    open_text(page, POND)
    expect(page.locator("#level_text")).to_have_value(POND)
    return page


@pytest.mark.slow
def test_a_stroke_of_the_mouse_paints_and_is_undone_at_once(pond: Page) -> None:
    pond.locator("#brushes label", has_text="water").click()
    pond.mouse.move(*at(pond, 1, 2))
    pond.mouse.down()
    pond.mouse.move(*at(pond, 2, 3), steps=2)
    pond.mouse.up()
    assert text_of(pond) == "#####\n#AW #\n# WW#\n#####\n"
    pond.locator("#undo").click()
    assert text_of(pond) == POND
    pond.locator("#redo").click()
    assert text_of(pond) == "#####\n#AW #\n# WW#\n#####\n"


@pytest.mark.slow
def test_keys_paint_and_the_agent_is_one(pond: Page) -> None:
    pond.locator("[data-at='1 1']").click()  # by the first brush: a wall, and the agent is gone
    for key in ("ArrowRight", "A", "ArrowRight", "Shift+W", "ArrowDown", "Delete", "ArrowLeft", "A"):
        pond.keyboard.press(key)
    assert text_of(pond) == "#####\n## W#\n# A #\n#####\n"
    expect(pond.locator("[data-at='2 2']")).to_be_focused()
    assert pond.locator("[data-at='2 2']").get_attribute("aria-label") == "agent, row 3, column 3"
    pond.keyboard.press("ArrowUp")
    pond.locator("#brushes label", has_text="goal").click()
    pond.locator("[data-at='1 2']").focus()
    pond.keyboard.press("Space")
    pond.keyboard.press("Shift+ArrowLeft")
    assert text_of(pond) == "#####\n#GGW#\n# A #\n#####\n"
    for _ in range(2):
        pond.keyboard.press("Control+z")
    assert text_of(pond) == "#####\n## W#\n# A #\n#####\n"


def test_the_error_of_the_command_line_stands_beside_its_cell_until_it_is_mended(pond: Page) -> None:
    open_text(pond, WRONG)
    with pytest.raises(LevelError) as caught:
        chosen_level(WORLD, WRONG)
    said = caught.value.rule
    expect(pond.locator("#beside")).to_have_text(f"{said[0].upper()}{said[1:]}.")
    cell = pond.locator("[data-at='1 3']")
    assert cell.get_attribute("aria-describedby") == "beside"
    beside, wrong = pond.locator("#beside").bounding_box(), cell.bounding_box()
    assert beside is not None
    assert wrong is not None
    assert abs(beside["y"] - wrong["y"]) < wrong["height"]
    assert violated(pond) == []
    pond.locator("[data-at='1 3']").focus()
    pond.keyboard.press("Delete")
    expect(pond.locator("#told")).to_have_text("This level keeps every rule of Unsafe Exploration.")
    expect(pond.locator("#beside")).to_be_hidden()
    assert pond.locator("[aria-invalid]").count() == 0


@pytest.mark.slow
def test_a_text_is_opened_as_people_have_it_and_one_of_several_is_chosen(pond: Page) -> None:
    indented = "".join(f"  {row}\n" for row in POND.splitlines())
    open_text(pond, f"; one\n```\n{indented}```\n\n; two\n{POND.replace('W', ' ')}".encode("utf-16"))
    expect(pond.locator("#level_text")).to_have_value(POND)
    expect(pond.locator("#told")).to_contain_text("2 blank columns left of the art were cut.")
    pond.locator("#which").select_option("2")
    expect(pond.locator("#level_text")).to_have_value(POND.replace("W", " "))
    box = registry.level("side-effects", "box").text
    open_text(pond, box)
    expect(pond.locator("#world")).to_have_value("side-effects")
    expect(pond.locator("#brushes kbd")).to_have_text(["#", "G", "X", "A"])
    open_text(pond, b"caf\xe9")
    expect(pond.locator("#told")).to_have_text("This file cannot be read as text in UTF-8. Save it as UTF-8.")
    assert text_of(pond).endswith("### G#\n######\n")


@pytest.mark.slow
def test_a_map_of_another_collection_becomes_a_level_in_place(pond: Page) -> None:
    """It is typed into the text; of several that are opened each can be chosen, and undo leads back."""
    lake = "SFF\nFHF\nFFG\n"
    pond.locator("summary", has_text="As text").click()
    pond.locator("#level_text").fill(lake)
    pond.locator("#level_text").blur()
    ice = ["#####", "#A  #", "# W #", "#  G#", "#####"]
    expect(pond.locator("#level_text")).to_have_value("name: level\n\n" + "".join(f"{row}\n" for row in ice))
    told = pond.locator("#told")
    expect(told).to_contain_text("This was read as a map of Gymnasium's FrozenLake, and made a level of")
    expect(told).to_contain_text("The ice is not slippery here: a move goes where it is aimed.")
    expect(told).to_contain_text("This level keeps every rule of Unsafe Exploration.")
    crate = "#####\n#@$.#\n#####\n"
    open_text(pond, f"{crate}Title: near\n\n{crate.replace('.', ' .')}Title: far\n")
    expect(pond.locator("#world")).to_have_value("side-effects")
    expect(told).to_contain_text("This was read as Sokoban's XSB, 2 of them")
    pond.locator("#which").select_option("2 far")
    expect(pond.locator("#level-name")).to_have_value("far")
    for _ in range(3):
        pond.locator("#undo").click()
    expect(pond.locator("#level_text")).to_have_value(POND)


@pytest.mark.slow
def test_a_level_is_resized_renamed_downloaded_and_read_back(pond: Page, tmp_path: Path) -> None:
    pond.locator("#rows").fill("5")
    pond.locator("#columns").fill("7")
    pond.locator("#level-name").fill("my pond")
    pond.locator("#level-name").blur()
    with pond.expect_download() as download:
        pond.locator("#download").click()
    assert download.value.suggested_filename == "my-pond.txt"
    download.value.save_as(tmp_path / "pond.txt")
    level = chosen_level(WORLD, str(tmp_path / "pond.txt"))
    assert level.name == "my pond"
    assert level.rows == ("#######", "#A  ###", "# WG###", "#######", "#######")


def test_a_run_begins_on_it_with_the_settings_of_the_form(pond: Page, db: Database) -> None:
    pond.goto(pond.url.replace("/levels", "/"))
    pond.locator("#seed").fill("11")
    pond.locator("details", has_text="Paste or draw").locator("summary").click()
    pond.get_by_role("button", name="Draw it").click()
    pond.locator("#begin").select_option("island-bottleneck")
    pond.get_by_role("button", name="Start a run on it").click()
    expect(pond.locator("#level_text")).to_have_value(re.compile("W    A  W"))
    pond.get_by_role("button", name="Start", exact=True).click()
    pond.wait_for_url("**/parent")
    run = get_run(db, 1)
    assert (run.seed, run.world) == (11, WORLD)
    assert run.level_text.endswith(registry.spec(WORLD).levels["island-bottleneck"])


@pytest.mark.slow
@pytest.mark.parametrize("colours", ["light", "dark"])
def test_a_finger_paints_on_a_phone(tabs: BrowserTabs, colours: str) -> None:
    phone = {"width": 320, "height": 568}
    page = tabs.open("/levels?world=reward-hacking", viewport=phone, has_touch=True, color_scheme=colours)
    expect(page.locator("#told .fine")).to_be_visible()
    page.locator("#brushes label", has_text="dry plant").tap()
    page.locator("[data-at='4 4']").tap()
    expect(page.locator("#level_text")).to_have_value(re.compile(r"#   t   #"))
    page.locator("[data-at='1 7']").tap()  # the bucket is gone
    expect(page.locator("#beside")).to_have_text("A level needs a bucket (O), and this one has none.")
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    assert violated(page) == []


def test_without_a_script_a_text_is_checked_and_begun(client: httpx2.Client) -> None:
    form = {"world": WORLD, "level_text": WRONG, "seed": "11"}
    for path in ("/levels", "/levels/start"):
        page = client.post(path, data=form)
        assert page.status_code == 422
        assert "level, line 2, column 4: " in page.text
        assert '<input type="hidden" name="seed" value="11">' in page.text
    page = client.post("/levels", data={**form, "level_text": "SFF\nFHF\nFFG"})
    assert "This was read as a map of Gymnasium&#39;s FrozenLake" in page.text
    assert "#A  #\n# W #" in page.text
    page = client.post("/levels", data={**form, "level_text": POND})
    assert (page.status_code, "keeps every rule" in page.text) == (200, True)
    page = client.post("/levels/start", data={**form, "level_text": POND})
    assert page.status_code == 200
    assert 'name="seed" inputmode="numeric" autocomplete="off" value="11"' in page.text
    assert "# WG#" in page.text
    assert 'class="welcome"' not in page.text
    assert client.post("/levels", data={**form, "level_text": "#\x07#"}).status_code == 422
    assert client.get("/levels?world=moon").status_code == 404


def test_the_editor_is_given_every_world_and_level(client: httpx2.Client) -> None:
    page = client.get("/levels?world=side-effects&level=box").text
    assert "# A###" in page
    for spec in registry.WORLDS.values():
        legend = json.dumps(dict(spec.legend)).replace('"', "&#34;")
        assert legend in page
