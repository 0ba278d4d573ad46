"""The configurations of docs/operations.md, each run by its program on a port of loopback before a server."""

from __future__ import annotations

import re
import shutil
import ssl
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest

from tests.server.serving import free_port
from tests.tree import ROOT

NAME = "parenting.example"

NGINX = """
user root; # said of an administrator only: the folder of the test is closed to other users
daemon off; pid FOLDER/pid; worker_processes 1; events {}
http {
    access_log off; include FOLDER/site.conf;
    client_body_temp_path FOLDER/body; proxy_temp_path FOLDER/proxy;
    fastcgi_temp_path FOLDER/fastcgi; scgi_temp_path FOLDER/scgi; uwsgi_temp_path FOLDER/uwsgi;
}
"""


def configuration(language: str, changes: dict[str, str]) -> str:
    """The block of docs/operations.md in this language, with other ports and files; each must be there."""
    page = (ROOT / "docs/operations.md").read_text(encoding="utf-8")
    blocks: list[str] = re.findall(rf"^```{language}\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    (text,) = blocks
    for old, new in changes.items():
        assert old in text, f"the block {language} of docs/operations.md has no {old}"
        text = text.replace(old, new)
    return text


def nginx(folder: Path, port: int, upstream: int) -> list[str]:
    """Write its files and return its command."""
    changes = {
        "listen 443 ": f"listen 127.0.0.1:{port} ",
        "127.0.0.1:8765": f"127.0.0.1:{upstream}",
        "/etc/ssl/parenting.pem": f"{folder}/certificate.pem",
        "/etc/ssl/private/parenting.key": f"{folder}/key.pem",
        "/var/log/nginx/parenting.log": f"{folder}/log",
    }
    (folder / "site.conf").write_text(configuration("nginx", changes))
    (folder / "nginx.conf").write_text(NGINX.replace("FOLDER", str(folder)))
    return ["nginx", "-c", f"{folder}/nginx.conf", "-p", str(folder), "-e", "stderr"]


def caddy(folder: Path, port: int, upstream: int) -> list[str]:
    """Write its file and return its command. No other port is opened, and no certificate fetched."""
    changes = {
        "{\n\tservers": "{\n\tadmin off\n\tauto_https off\n\tservers",
        f"\n{NAME} {{\n": f"\n{NAME}:{port} {{\n\tbind 127.0.0.1\n"
        f"\ttls {folder}/certificate.pem {folder}/key.pem\n",
        "127.0.0.1:8765": f"127.0.0.1:{upstream}",
    }
    (folder / "Caddyfile").write_text(configuration("caddyfile", changes))
    return ["caddy", "run", "--config", f"{folder}/Caddyfile", "--adapter", "caddyfile"]


COMMANDS = {"nginx": nginx, "caddy": caddy}


@contextmanager
def proxy(program: str, folder: Path, upstream: int, token: str) -> Iterator[httpx2.Client]:
    """A program with a token, which speaks to the upstream's port by way of this program."""
    for needed in (program, "openssl"):
        if shutil.which(needed) is None:
            pytest.skip(f"{needed} is not installed")
    _make_certificate(folder)
    port = free_port()
    command = COMMANDS[program](folder, port, upstream)
    homes = {name: str(folder) for name in ("HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME")}
    said = folder / "said"
    with said.open("wb") as output:
        child = subprocess.Popen(
            command, cwd=folder, env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", **homes}, stderr=output
        )
    try:
        with client(port, folder, token) as found:
            _await(found, child, said)
            yield found
    finally:
        child.terminate()
        try:
            child.wait(20)
        except subprocess.TimeoutExpired:  # Caddy waits for connections that a failed test has left open
            child.kill()
            child.wait()


def client(port: int, folder: Path, token: str) -> httpx2.Client:
    """A client with a token, of the host that the certificate names, at a port of this machine."""

    def name_host(request: httpx2.Request) -> None:
        request.extensions["sni_hostname"] = NAME

    return httpx2.Client(
        base_url=f"https://127.0.0.1:{port}",
        verify=ssl.create_default_context(cafile=folder / "certificate.pem"),
        headers={"Host": f"{NAME}:{port}", "Authorization": f"Bearer {token}"},
        auth=None,
        timeout=30,
        trust_env=False,
        event_hooks={"request": [name_host]},
    )


def _await(found: httpx2.Client, child: subprocess.Popen[bytes], said: Path) -> None:
    end = time.monotonic() + 60
    while True:
        try:
            reply = found.get("/healthz")
            assert reply.status_code == 200, reply.text
            return
        except httpx2.TransportError:
            assert child.poll() is None, said.read_text()
            assert time.monotonic() < end, said.read_text()
            time.sleep(0.05)


def _make_certificate(folder: Path) -> None:
    words = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2"
    name = ["-subj", f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME}"]
    files = ["-keyout", str(folder / "key.pem"), "-out", str(folder / "certificate.pem")]
    subprocess.run([*words.split(), *name, *files], check=True, capture_output=True)
