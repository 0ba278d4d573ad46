"""`parenting policy`: write the present policy of a run to a file."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.server.backups.whole import file_at
from parenting.server.policies import PolicyFile, present_policy


def policy(
    run: RunNumber,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE", help="Write to this file.", show_default="named by run and tick"
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print what the file holds as JSON.")] = False,
) -> None:
    """Write the present policy of a run to a file of safetensors, as its last checkpoint has it.

    The file holds the weights and a model card: world, level, config, the size of X, hashes, the run, and how
    to load it. `parenting.load_policy(FILE)` reads it. The run may go on meanwhile.

    Exit codes: 0 written; 2 the run or the database does not exist, the run has no checkpoint yet, or the
    file cannot be written.

    Example: parenting policy 3 --out careful.safetensors
    """
    with friendly_errors():
        with database() as db:
            found = present_policy(db, run)
        target = out or Path(found.name)
        _write(target, found.blob, force)
    sha256 = hashlib.sha256(found.blob).hexdigest()
    if as_json:
        say(json.dumps({"file": str(target), "sha256": sha256, **found.about}))
        return
    say(_told(run, target, sha256, found))


def _told(run: int, target: Path, sha256: str, found: PolicyFile) -> str:
    source = found.about["source"]
    return (
        f"The policy of run {run} after tick {source['tick']}, stage {found.about['stage']}, is written to"
        f" {target}.\nSHA-256: {sha256}\n"
        f"Load it: parenting.load_policy({str(target)!r})"
    )


def _write(target: Path, blob: bytes, force: bool) -> None:
    """Write a file that takes its name once it is complete.

    Raises:
        UsageError: the file exists, or its folder cannot be written to.
        SetupError: it is not a file but something else.
    """
    target = file_at(target)
    if target.exists() and not force:
        raise UsageError(f"--out: {target} exists already. Name another file, or give --force to replace it.")
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        part.write_bytes(blob)
        part.replace(target)
    except OSError as error:
        raise UsageError(f"--out: {target} cannot be written: {error.strerror}.") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
