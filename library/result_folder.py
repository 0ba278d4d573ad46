"""Results in folders: JSON and CSV that people read, and safetensors. A folder is whole or not there."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import torch

from parenting._cells import whole_rows
from parenting.agent.config import Config
from parenting.library.answer_log import COLUMNS, EVENT_COLUMNS
from parenting.library.policy import Policy
from parenting.library.policy_file import (
    FORMAT,
    FormatError,
    about_world,
    check_format,
    read_tensors,
    world_from,
    write_tensors,
)
from parenting.library.worlds import World

Record = dict[str, Any]

TABLES = ("trials", "answers", "events")
EMPTY: Mapping[str, Sequence[str]] = {"trials": (), "answers": COLUMNS, "events": EVENT_COLUMNS}
"""The columns of tables without a row, since pandas refuses a file without any."""
ABOUT, POLICIES = "result.json", "policies.safetensors"
READERS: Mapping[str, Callable[[str], Any]] = {
    "bool": lambda text: text == "true",
    "int": int,
    "float": float,
    "str": str,
}
"""A column's reader, by the type that `result.json` gives it. An empty cell is None."""


class Fields(NamedTuple):
    """A result as it is stored: the fields of `TrainResult`, in their order."""

    world: World
    config: Config
    seed: int
    until: str
    policies: Sequence[Policy]
    trials: list[Record]
    answers: list[Record]
    events: list[Record]
    origin: Record
    parent: str | None
    max_ticks: int | None


def write(folder: Path, result: Fields, numbers: Record, overwrite: bool) -> Path:
    """Write a result, with final numbers for its readers, beside its place, then move it there."""
    taken = folder.is_file() or (folder.is_dir() and any(folder.iterdir()))
    if taken and not (overwrite and (folder / ABOUT).is_file()):
        remedy = "Pass overwrite=True to replace it" if (folder / ABOUT).is_file() else "Name another folder"
        raise FileExistsError(f"folder: {folder} holds something already. {remedy}.")
    fresh, old = (folder.with_name(f".{folder.name}.{os.getpid()}.{what}") for what in ("new", "old"))
    fresh.mkdir(parents=True)
    try:
        _fill(fresh, result, numbers)
        if folder.exists():
            folder.replace(old)
        fresh.replace(folder)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)
    return folder


def read(folder: Path) -> Fields:
    """Read what `write` wrote.

    Raises:
        FormatError: There is no such folder, it is damaged, or a later version wrote it.
    """
    try:
        about = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(
            f"{folder} is not a saved result: {ABOUT} cannot be read ({error.strerror})."
        ) from None
    except ValueError as error:
        raise FormatError(f"{folder / ABOUT} is damaged: {error}.") from None
    check_format(folder / ABOUT, about, "result")
    try:
        return _read(folder, about)
    except FormatError:
        raise
    except (KeyError, OSError, TypeError, ValueError) as error:
        raise FormatError(f"{folder} is damaged: {str(error).rstrip('.')}.") from None


def _fill(folder: Path, result: Fields, numbers: Record) -> None:
    about = {
        "format": FORMAT,
        "kind": "result",
        **about_world(result.world),
        "config": result.config.model_dump(mode="json"),
        "seed": result.seed,
        "until": result.until,
        "parent": result.parent,
        "max_ticks": result.max_ticks,
        **numbers,
        **({"origin": result.origin} if result.origin else {}),
        "columns": {name: _types(getattr(result, name)) for name in TABLES},
    }
    (folder / ABOUT).write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    for name in TABLES:
        (folder / f"{name}.csv").write_text(_csv(getattr(result, name), EMPTY[name]), encoding="utf-8")
    parameters = torch.stack([policy.parameters for policy in result.policies])
    write_tensors(folder / POLICIES, {"parameters": parameters}, "policies", about_world(result.world))


def _read(folder: Path, about: dict[str, Any]) -> Fields:
    config = Config.model_validate(about["config"])
    world = world_from(folder, about, config)
    tables = {name: _rows(folder / f"{name}.csv", about["columns"][name]) for name in TABLES}
    parameters = read_tensors(folder / POLICIES, "policies")[0]["parameters"]
    policies = [
        Policy(world, config, one, stage=row["stage"], trial=row["trial"], seed=about["seed"])
        for one, row in zip(parameters, tables["trials"], strict=True)
    ]
    trials, answers, events = (tables[name] for name in TABLES)
    made = world, config, about["seed"], about["until"], policies, trials, answers, events
    # older folders lack these
    return Fields(*made, about.get("origin", {}), about.get("parent"), about.get("max_ticks"))


def _types(records: Sequence[Record]) -> dict[str, str]:
    """Return each column's type; a column of nothing but None is of text."""
    found: dict[str, str] = {}
    for record in records:
        for name, value in record.items():
            if value is not None or name not in found:
                found[name] = "str" if value is None else type(value).__name__
    return found


def _csv(records: Sequence[Record], empty: Sequence[str]) -> str:
    out = io.StringIO()
    columns = list(_types(records) or empty)
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(record.get(name)) for name in columns] for record in records)
    return out.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return (
        str(value).lower()
        if isinstance(value, bool)
        else repr(value)
        if isinstance(value, float)
        else str(value)
    )


def _rows(path: Path, types: Mapping[str, str]) -> list[Record]:
    rows = list(whole_rows(io.StringIO(path.read_text(encoding="utf-8")), path.name))
    return [
        {name: READERS[kind](row[name]) if row[name] != "" else None for name, kind in types.items()}
        for row in rows
    ]
