"""Checks of a request's head that the parser leaves open."""

from __future__ import annotations

from collections.abc import Sequence

import httptools


class UnclearHeadError(Exception):
    """Two programs could read this head differently; the message says why."""


def check_head(method: bytes, target: bytes, version: str, headers: Sequence[tuple[bytes, bytes]]) -> None:
    """Refuse a head that two programs could read differently.

    Raises:
        UnclearHeadError: several Host headers, a target that names another host, a Transfer-Encoding
            besides chunked, or the method CONNECT.
    """
    hosts = [value for name, value in headers if name == b"host"]
    if len(hosts) > 1 or (not hosts and version == "1.1"):
        raise UnclearHeadError("Host: there must be exactly one.")
    codings = [value.strip().lower() for name, value in headers if name == b"transfer-encoding"]
    lengths = [value for name, value in headers if name == b"content-length"]
    if codings and (codings != [b"chunked"] or lengths or version != "1.1"):
        raise UnclearHeadError("Transfer-Encoding: send chunked, once, and no Content-Length.")
    if len(lengths) > 1:
        raise UnclearHeadError("Content-Length: there must be at most one.")
    if method == b"CONNECT":
        raise UnclearHeadError("CONNECT: this server is not a proxy.")
    if not target.startswith(b"/") and _authority(target) != hosts[:1]:
        raise UnclearHeadError("The target must begin with '/', or name the same host as Host.")


def _authority(target: bytes) -> list[bytes]:
    url = httptools.parse_url(target)
    if url.schema not in (b"http", b"https") or not url.host or url.userinfo or not url.path:
        return []
    port = b":%d" % url.port if url.port else b""
    host = b"[" + url.host + b"]" if b":" in url.host else url.host
    return [host + port]
