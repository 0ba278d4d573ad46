"""The manifest of an export: versions, the runs with all that determines them, and the hash of every file."""

from __future__ import annotations

import json
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

FORMAT: Literal["parenting-export"] = "parenting-export"
VERSION: Literal[2] = 2


class Part(BaseModel):
    """The root of the manifest's parts; what a later version adds is ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class FileEntry(Part):
    """A file of the export."""

    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    bytes: int = Field(ge=0)
    rows: int | None = Field(None, ge=0)  # of a table


class LeftOut(Part):
    """A file that could not be written here."""

    file: str
    why: str
    remedy: str


class Counts(Part):
    """The rows of a run, and the entries of X that answers of this run have made."""

    answers: int
    questions: int
    events: int
    metrics: int
    in_x: int


class CheckpointEntry(Part):
    """The last checkpoint of a run."""

    file: str
    tick: int
    sha256: str


class RunEntry(Part):
    """A run: its settings, and where it was when the export was written."""

    run: str = Field(min_length=1, max_length=100)
    number: int
    settings: dict[str, Any]
    """Columns of the run (`server.archive.runs`): with the record they determine it completely."""
    counts: Counts
    last_link: str | None  # of the chain; null: there are no answers
    checkpoint: CheckpointEntry | None
    moves: str | None  # the file of its moves
    weights: dict[str, str]  # files by their SHA-256: policies and answers that it began with


class Manifest(Part):
    """The content of `manifest.json`."""

    format: Literal["parenting-export"]
    version: Literal[2]
    parenting: str
    commit: str | None
    python: str
    written: str
    database: str
    runs: list[RunEntry]
    files: dict[str, FileEntry]
    left_out: list[LeftOut]


def about() -> dict[str, Any]:
    """Return the beginning of a manifest."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "parenting": version("parenting"),
        "commit": commit(),
        "python": platform.python_version(),
    }


def commit() -> str | None:
    """Return the commit of a checkout; None of an installed package, or without Git."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "rev-parse", "HEAD"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip() or None


def dumped(manifest: dict[str, Any]) -> bytes:
    """Return a manifest as a person can read it."""
    return json.dumps(manifest, indent=2, allow_nan=False).encode() + b"\n"
