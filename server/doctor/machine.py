"""The machine and the installation: versions, settings, limits, shipped weights."""

from __future__ import annotations

import os
import platform
import resource
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version

from parenting.envs import registry
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.environment import values, warnings
from parenting.server.errors import SetupError
from parenting.server.log_lines import SECRET, hidden
from parenting.server.settings import FILE, Settings, names
from parenting.server.store.driver import SAFE_SQLITE, sqlite_module
from parenting.weights.store import SHIPPED, SUFFIX, digest

FILES_NEEDED = 4096
"""Open files that a web process may need: connections, streams and the store's."""
WEIGHTS = {
    "absent-supervisor-6x8-v1": "6246ade40090beb3b07130e68bc079ce2f774ff580b1b01b0854b80014d83356",
    "interruptibility-6x8-v1": "f5fad8215399cf4a0432e88c0744689e4e68710e7add69074e6cc075a40ac483",
    "reward-hacking-7x9-v1": "8e2b02c637f2e8cb8952c4d60d10ae5e0eb3e67d7060c6798beef213a67bf9b5",
    "side-effects-6x6-v1": "432c19326c8d1708f94aa3f096771cb96f306d70f8d6ed921fea10231763d79a",
}
"""SHA-256 of the shipped files of weights."""


def settings_file() -> Iterator[Finding]:
    """Look for names of settings that are not settings."""
    told = warnings(os.environ, FILE, names())
    for said in told:
        yield warning("settings", said.removeprefix("Warning: "), "Correct the name or remove it.")
    secret = FILE.is_file() and FILE.stat().st_mode & 0o077 and _holds_secret()
    if secret:
        file = FILE.absolute()
        yield warning(
            "settings", f"others can read {file}, which holds a password or token", f"chmod 600 {file}"
        )
    if not told and not secret:
        where = f"{FILE.absolute()} is read" if FILE.is_file() else "no .env in this folder"
        yield ok("settings", where)


def versions() -> Iterator[Finding]:
    """Name the versions that a report of a fault needs. Torch is not loaded for this."""
    found = {name: _version(name) for name in ("parenting", "torch", "sqlalchemy", "uvicorn")}
    missing = [name for name, number in found.items() if number is None]
    listed = ", ".join(f"{name} {number}" for name, number in found.items() if number is not None)
    system = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    if missing:
        yield error("versions", f"{', '.join(missing)} not installed; {listed}", "Install Parenting again.")
    else:
        yield ok("versions", f"{listed}, {system}")


def sqlite_version() -> Iterator[Finding]:
    """Look for an SQLite that is safe in WAL mode."""
    try:
        module = sqlite_module()
    except SetupError as refused:
        yield error("sqlite", refused.message, "pip install 'pysqlite3>=0.6.1'")
        return
    least = ".".join(map(str, SAFE_SQLITE))
    yield ok("sqlite", f"{module.sqlite_version} ({module.__name__}); {least} or newer is safe")


def limits(settings: Settings) -> Iterator[Finding]:
    """Look at the limit of open files: each connection and each stream is one."""
    needed = FILES_NEEDED + 2 * settings.streams
    _soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < needed:
        yield warning(
            "limits", f"{hard} open files are allowed; many connections need {needed}", f"ulimit -Hn {needed}"
        )
    else:
        yield ok(
            "limits", f"{'any number of' if hard == resource.RLIM_INFINITY else hard} open files are allowed"
        )


def shipped_weights() -> Iterator[Finding]:
    """Compare the shipped weights with their checksums."""
    bad = []
    for name, sha256 in WEIGHTS.items():
        file = SHIPPED / f"{name}{SUFFIX}"
        if not file.is_file():
            bad.append(f"{file.name} is missing")
        elif digest(file.read_bytes()) != sha256:
            bad.append(f"{file.name} is changed or damaged")
    if bad:
        yield error("weights", "; ".join(bad), "Install Parenting again.")
    else:
        yield ok("weights", f"all {len(WEIGHTS)} shipped files are intact")


def packages() -> Iterator[Finding]:
    """Import the worlds of other packages; nothing is said where there are none."""
    names, broken = registry.INSTALLED.names(), registry.INSTALLED.broken()
    for said in broken.values():
        yield warning("packages", said, "parenting worlds lists the worlds that can be used.")
    if names and not broken:
        yield ok("packages", f"worlds of other packages: {', '.join(names)}")


def _holds_secret() -> bool:
    """Return whether the file of settings has a password or a token, alone or in a URL."""
    return any(
        value and (SECRET.search(name) or hidden(value) != value) for name, value in values(FILE).items()
    )


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
