"""Parts of a page's script that load when they are needed share what the page runs already, in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Route

from parenting.server.assets import Asset, page_scripts

SOURCES = {
    "page.js": """
import first, { add, total as sum,
  Shape } from "./shared.js";
import * as changing from "./changing.js";
import "./effect.js";
window.run = [...(window.run ?? []), "page"];
add(1);
export const whole = () => sum();
const { times } = changing, { name } = new Shape();
const effect = () => window.effect;
window.known = () => ({ first, sum: whole(), before: times, changed: changing.times, name, [effect()]: 1 });
window.early = () => import("./shared.js").then((all) => [all.total(), all.default, all.size, all.more]);
window.load = (which) => (which === "walk" ? import("./walk.js") : import( "./history.js" ));
""",
    "shared.js": """
const numbers = [10]; // not exported
export default "first";
export function add(number) { numbers.push(number); }
export async function later() { return total(); }
export class Shape { name = "shape"; }
export const size = [1, 2].length, more = ((a, b = "x, y") => a + b)("b", ";"), LETTER = /[,;]/;
const total = () => numbers.reduce((a, b) => a + b);
export { total };
""",
    "changing.js": "export let times = 0;\nexport function change() { times += 1; }\n",
    "effect.js": 'window.effect = "ran";\n',
    "walk.js": """
import { add, total } from "./shared.js";
import { change } from "./changing.js";
import { once } from "./between.js";
import { ring } from "./ring.js";
export default function () { return "default"; }
export function walk() { add(100); change(); return total(); }
export const mark = once, round = ring;
export const home = () => import("./page.js");
export function back() { return "from walk"; }
export const further = () => import("./history.js");
""",
    "ring.js": 'import { back as home } from "./walk.js";\nexport const ring = () => home();\n',
    "history.js": """
import { once } from "./between.js";
export { once as mark };
export const walk = () => import("./walk.js");
""",
    "between.js": 'window.run = [...window.run, "between"];\nexport const once = {};\n',
}
AT = "http://pages.test"


NESTED = {
    "page.js": 'export const load = () => import("./first.js");\n',
    "first.js": 'import { rare } from "./rare.js";\nexport default () => [rare, import("./second.js")];\n',
    "second.js": 'import { rare } from "./rare.js";\nexport const same = rare;\n',
    "rare.js": "export const rare = [7001];\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in SOURCES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def made(folder: Path) -> dict[str, Asset]:
    return page_scripts("page.js", folder)


@pytest.fixture
def page(browser: Browser, made: dict[str, Asset]) -> Iterator[Page]:
    """A page that runs the scripts and can reach nothing else."""
    files = {f"{AT}/static/{one.name}": one for one in made.values()}
    home = f'<script type="module" src="/static/{made["page.js"].name}"></script>'

    def reply(route: Route) -> None:
        asset = files.get(route.request.url)
        if route.request.url == f"{AT}/":
            route.fulfill(body=home, content_type="text/html")
        elif asset is None:
            route.fulfill(status=404)
        else:
            route.fulfill(body=asset.content, content_type=asset.media)

    context = browser.new_context()
    page = context.new_page()
    page.route("**/*", reply)
    page.goto(f"{AT}/")
    yield page
    context.close()


def test_each_way_to_import_and_export_means_what_it_does_in_modules(page: Page) -> None:
    known = {"first": "first", "sum": 11, "before": 0, "changed": 0, "name": "shape", "ran": 1}
    assert page.evaluate("known()") == known
    assert page.evaluate("early()") == [11, "first", 2, "b;"]
    assert page.evaluate("load('walk').then(({ default: it, round }) => [it(), round()])") == [
        "default",
        "from walk",
    ]


def test_later_part_shares_what_the_page_runs(page: Page) -> None:
    assert page.evaluate("load('walk').then((found) => found.walk())") == 111
    assert page.evaluate("known()")["sum"] == 111
    assert page.evaluate("known()")["changed"] == 1
    assert page.evaluate("load('walk').then((found) => found.home()).then((found) => found.whole())") == 111
    assert page.evaluate("run") == ["page", "between"]


def test_module_that_two_later_parts_carry_runs_once(page: Page) -> None:
    both = "Promise.all([load('walk'), load('history'), load('walk')])"
    assert page.evaluate(f"{both}.then(([a, b, c]) => a.mark === b.mark && a === c)")
    assert page.evaluate("load('history').then((one) => one.walk()).then((one) => one.walk())") == 111
    assert page.evaluate("load('walk').then((one) => one.further()).then((one) => Object.keys(one))") == [
        "mark",
        "walk",
    ]
    assert page.evaluate("run") == ["page", "between"]


def test_part_that_did_not_arrive_is_asked_for_again(page: Page, made: dict[str, Asset]) -> None:
    lost: list[str] = []

    def lose(route: Route) -> None:
        lost.append(route.request.url)
        if len(lost) > 1:
            return route.fallback()
        return route.abort()

    page.route("**/page-walk.*", lose)
    assert page.evaluate("load('walk').then(() => 'arrived', () => 'lost')") == "lost"
    assert page.evaluate("load('walk').then((found) => found.walk())") == 111
    assert len(lost) == 2


def test_content_of_a_later_part_changes_its_address_and_the_pages(folder: Path) -> None:
    before = {name: one.name for name, one in page_scripts("page.js", folder).items()}
    assert set(before) == {"page.js", "page-walk.js", "page-history.js"}
    (folder / "walk.js").write_text(SOURCES["walk.js"].replace("from walk", "from there"))
    after = {name: one.name for name, one in page_scripts("page.js", folder).items()}
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"page.js", "page-walk.js"}


def test_part_that_another_part_loads_carries_nothing_of_that_again(tmp_path: Path) -> None:
    for name, text in NESTED.items():
        (tmp_path / name).write_text(text)
    found = {name: one.content.decode() for name, one in page_scripts("page.js", tmp_path).items()}
    assert [name for name, text in found.items() if "7001" in text] == ["page-first.js"]
    (tmp_path / "page.js").write_text(
        NESTED["page.js"] + 'export const other = () => import("./second.js");\n'
    )
    found = {name: one.content.decode() for name, one in page_scripts("page.js", tmp_path).items()}
    assert [name for name, text in found.items() if "7001" in text] == ["page-first.js", "page-second.js"]
