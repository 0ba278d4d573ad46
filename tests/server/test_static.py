"""Static files: our own and those of other packages; the browser asks each time whether it has the newest."""

import httpx2
import pytest

from parenting.server.errors import NotFound
from parenting.server.static import VENDOR, OthersFiles

pytestmark = pytest.mark.only("sqlite", "files of the pages")


@pytest.mark.parametrize("path", ["site.css", "live.js", *(f"vendor/{name}" for name in VENDOR)])
def test_a_copy_is_asked_about_and_not_sent_again(client: httpx2.Client, path: str) -> None:
    first = client.get(f"/static/{path}")
    assert (first.status_code, first.headers["cache-control"]) == (200, "no-cache")
    again = client.get(f"/static/{path}", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content, again.headers["cache-control"]) == (304, b"", "no-cache")
    assert client.get(f"/static/{path}", headers={"If-None-Match": '"older"'}).content == first.content


@pytest.mark.parametrize(
    ("path", "media", "begin"),
    [
        ("live.js", "text/javascript", b""),
        ("site.css", "text/css", b""),
        ("icon.svg", "image/svg+xml", b"<svg"),
        ("vendor/plotly.min.js", "text/javascript", b"/**\n* plotly.js v"),
        ("vendor/swagger-ui.js", "text/javascript", b""),
        ("vendor/swagger-ui.css", "text/css", b".swagger-ui"),
    ],
)
def test_what_is_served_as_what(client: httpx2.Client, path: str, media: str, begin: bytes) -> None:
    served = client.get(f"/static/{path}")
    assert served.headers["content-type"].startswith(media)
    assert served.content.lstrip().startswith(begin)


@pytest.mark.parametrize(
    "path",
    ["nothing.js", "vendor/nothing.js", "vendor", "vendor/site.css", "../app.py", "vendor/../../app.py"],
)
def test_nothing_else_is_served(client: httpx2.Client, path: str) -> None:
    assert client.get(f"/static/{path}").status_code == 404


def test_missing_package_is_named() -> None:
    files = OthersFiles({"charts.js": ("no-such-package", "charts.js")})
    with pytest.raises(NotFound, match=r"charts.js is not installed. Run: pip install no-such-package"):
        files.lookup_path("charts.js")
