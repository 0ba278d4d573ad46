"""Static files: our own, and those that other packages carry (found without an import, which is slow).

What pages load of ours has a hash of its content in its name, and a browser keeps it for good. About the rest
the browser asks each time whether its copy is current, and gets 304 if it is. So after an upgrade no page of
one version runs a script of another.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fastapi.staticfiles import StaticFiles
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, Response
from starlette.types import Scope

from parenting.server.assets import STATIC, Asset, hashed
from parenting.server.errors import NotFound

FOR_GOOD = "public, max-age=31536000, immutable"
VENDOR = {
    "plotly.min.js": ("plotly", "package_data/plotly.min.js"),
    "swagger-ui.js": ("fastapi-swagger", "resources/swagger-ui-bundle.js"),
    "swagger-ui.css": ("fastapi-swagger", "resources/swagger-ui.css"),
}
"""Name below /static/vendor: the distribution that carries the file, and where in its package."""


class OurFiles(StaticFiles):
    """The files of web/static, and the style sheets of drawings."""

    def __init__(self) -> None:
        super().__init__(directory=STATIC, packages=[("parenting.drawing", "style")])

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file, looked up and read in the event loop: it must not wait for a thread.

        While the store is locked, requests may hold every thread. Our files are small or kept in memory.
        """
        if scope["method"] not in ("GET", "HEAD"):
            raise HTTPException(405)
        if (asset := hashed(path)) is not None:
            return _kept(asset, scope)
        full, found = self.lookup_path(path)
        if found is None or not stat.S_ISREG(found.st_mode):
            raise HTTPException(404)
        response = self.file_response(full, found, scope)
        if isinstance(response, FileResponse):
            content = _content(full, found.st_mtime_ns, found.st_size)
            return Response(content, headers=dict(response.headers))
        return response

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        """Return the path of a file; a name that no file can have is one that is not there."""
        try:
            return super().lookup_path(path)
        except (OSError, ValueError):  # too long, or with a zero byte
            return "", None

    def file_response(self, full_path: Any, *more: Any, **named: Any) -> Response:
        """The file, or 304."""
        response = super().file_response(full_path, *more, **named)
        response.headers["Cache-Control"] = "no-cache"  # keep it, and ask each time
        if str(full_path).endswith(".js") and "content-type" in response.headers:
            response.headers["Content-Type"] = "text/javascript; charset=utf-8"  # whatever this machine says
        return response


class OthersFiles(OurFiles):
    """Files of other packages: only those of `VENDOR`."""

    def __init__(self, files: Mapping[str, tuple[str, str]] = VENDOR) -> None:
        super().__init__()
        self.found = {name: (package, _find(package, place)) for name, (package, place) in files.items()}

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        """Return the path of a file.

        Raises:
            NotFound: the package that carries it is not installed.
        """
        package, file = self.found.get(path, ("", None))
        if package and file is None:
            raise NotFound(f"{path} is not installed. Run: pip install {package}")
        return ("", None) if file is None else (str(file), file.stat())


def _kept(asset: Asset, scope: Scope) -> Response:
    """Return an asset, as it was compressed once, for a browser to keep."""
    content, encoding = asset.encoded(Headers(scope=scope).get("accept-encoding", ""))
    headers = {"Cache-Control": FOR_GOOD, "Vary": "Accept-Encoding", **encoding}
    return Response(content, headers=headers, media_type=asset.media)


@lru_cache(maxsize=128)
def _content(path: str, _changed: int, _size: int) -> bytes:
    """Return the bytes of a file, read again once it has changed."""
    return Path(path).read_bytes()


def _find(package: str, place: str) -> Path | None:
    spec = find_spec(package.replace("-", "_"))
    folders = [] if spec is None else spec.submodule_search_locations or []
    return next((file for folder in folders if (file := Path(folder, place)).is_file()), None)
