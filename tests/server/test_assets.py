"""One style sheet and one script a page: put together from their sources, addressed by their content."""

import gzip
import re
from pathlib import Path

import httpx2
import pytest

from parenting.server.assets import SCRIPTS, AssetError, asset, assets, script

pytestmark = pytest.mark.only("sqlite", "files of the pages")


def test_browser_keeps_what_has_its_content_in_its_name(client: httpx2.Client) -> None:
    for name, made in assets().items():
        plain = client.get(asset(name), headers={"Accept-Encoding": "identity"})
        assert plain.headers["cache-control"] == "public, max-age=31536000, immutable"
        assert (plain.content, plain.headers["content-type"]) == (made.content, made.media)
        packed = client.get(asset(name), headers={"Accept-Encoding": "gzip"})
        assert (packed.headers["content-encoding"], packed.content) == ("gzip", made.content)
        assert gzip.decompress(made.compressed) == made.content


def test_name_with_another_hash_is_not_served(client: httpx2.Client) -> None:
    address = asset("parent.js")
    older = address.replace(address.split(".")[1], "0" * 12)
    assert older != address
    assert client.get(older).status_code == 404


def test_small_replies_go_as_they_are_and_large_ones_compressed(client: httpx2.Client) -> None:
    headers = {"Accept-Encoding": "gzip"}
    assert "content-encoding" not in client.get("/healthz", headers=headers).headers
    assert client.get("/api/v1/openapi.json", headers=headers).headers["content-encoding"] == "gzip"


@pytest.mark.parametrize("name", SCRIPTS)
def test_one_script_loads_no_other(name: str) -> None:
    assert not re.search(r"^\s*(import|export)\b|\bimport\(", script(name), re.MULTILINE)


@pytest.mark.parametrize(
    "source",
    [
        'import all from "./b.js";\n',
        "export default 1;\n",
        "export let changing = 1;\n",
        'const later = import("./b.js");\n',
        'import { x } from "./b.js";\n',
    ],
)
def test_form_that_cannot_be_put_together_is_refused(tmp_path: Path, source: str) -> None:
    (tmp_path / "a.js").write_text(source + "export const mine = 1;\n")
    (tmp_path / "b.js").write_text('import { mine } from "./a.js";\nexport const x = 2;\n')
    with pytest.raises(AssetError, match=r"[ab]\.js"):
        script("a.js", tmp_path)
