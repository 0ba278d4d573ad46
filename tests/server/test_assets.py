"""One style sheet and one script a page: put together from their sources, addressed by their content."""

import gzip
import re
from pathlib import Path

import brotli
import httpx2
import pytest

from parenting.server.assets import SCRIPTS, Asset, asset, assets, page_scripts
from parenting.server.modules import AssetError

pytestmark = pytest.mark.only("sqlite", "files of the pages")


@pytest.mark.slow
def test_browser_keeps_what_has_its_content_in_its_name(client: httpx2.Client) -> None:
    for name, made in assets().items():
        plain = client.get(asset(name), headers={"Accept-Encoding": "identity"})
        assert plain.headers["cache-control"] == "public, max-age=31536000, immutable"
        assert (plain.content, plain.headers["content-type"]) == (made.content, made.media)
        for accepted, encoding in (("gzip", "gzip"), ("gzip, br", "br"), ("br;q=0, gzip;q=0.5", "gzip")):
            packed = client.get(asset(name), headers={"Accept-Encoding": accepted})
            assert (packed.headers["content-encoding"], packed.headers["vary"]) == (
                encoding,
                "Accept-Encoding",
            )
            assert packed.content == made.content
        assert gzip.decompress(made.gzipped) == brotli.decompress(made.brotlied) == made.content


def test_name_with_another_hash_is_not_served(client: httpx2.Client) -> None:
    address = asset("parent.js")
    older = address.replace(address.split(".")[1], "0" * 12)
    assert older != address
    assert client.get(older).status_code == 404


@pytest.mark.slow
def test_small_replies_go_as_they_are_and_large_ones_compressed(client: httpx2.Client) -> None:
    headers = {"Accept-Encoding": "gzip"}
    assert "content-encoding" not in client.get("/healthz", headers=headers).headers
    assert client.get("/api/v1/openapi.json", headers=headers).headers["content-encoding"] == "gzip"
    headers = {"Accept-Encoding": "gzip, deflate, br, zstd"}
    assert client.get("/", headers=headers).headers["content-encoding"] == "br"


@pytest.mark.parametrize("name", SCRIPTS)
def test_page_loads_one_script_at_once(name: str) -> None:
    loaded = page_scripts(name)
    assert not re.search(r"^\s*import\b(?!\()", "\n".join(map(_text, loaded.values())), re.MULTILINE)
    assert set(re.findall(r"/static/([\w.-]+)", _text(loaded[name]))) == {
        one.name for part, one in loaded.items() if part != name
    }


def _text(one: Asset) -> str:
    return one.content.decode()


@pytest.mark.parametrize(
    ("source", "line", "why"),
    [
        ('import * from "./b.js";\n', 2, "cannot be put into one script"),
        ('import "https://elsewhere.test/b.js";\n', 2, "cannot be put into one script"),
        ('export * from "./b.js";\n', 2, "cannot be put into one script"),
        ("import(name);\n", 2, "cannot be put into one script"),
        ("console.log(import.meta.url);\n", 2, "cannot be put into one script"),
        ("const now = await fetch('/');\n", 2, "cannot be put into one script"),
        ('import { x,\n  y } from "./b.js";\n', 2, "imports y of b.js, which has no such export"),
        ('import { x } from "./b.js";\n', 1, r"imports mine of a.js, which imports b.js: in a cycle"),
        ('import { z } from "./b.js";\n', 2, "imports z of b.js, which may change it later"),
    ],
)
def test_form_that_cannot_be_put_together_is_refused_by_file_and_line(
    tmp_path: Path, source: str, line: int, why: str
) -> None:
    (tmp_path / "a.js").write_text("// what it does\n" + source + "export const mine = 1;\n")
    (tmp_path / "b.js").write_text('import { mine } from "./a.js";\nexport const x = 2;\nexport let z = 3;\n')
    with pytest.raises(AssetError, match=rf"^[ab]\.js:{line} .*{why}"):
        page_scripts("a.js", tmp_path)


def test_script_that_is_not_there_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.js").write_text('const later = () => import("./gone.js");\n')
    with pytest.raises(AssetError, match=r"gone\.js"):
        page_scripts("a.js", tmp_path)
