"""One table of answers for `parenting import`, with the settings that its run had."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from parenting.commands.errors import UsageError, settings
from parenting.commands.progress import bar
from parenting.commands.run_settings import changes_of, level_of, said, weights_of
from parenting.envs import registry
from parenting.server.archive.format1 import Line, read_table
from parenting.server.archive.importing import Imported
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.run_form import read_form
from parenting.weights.origin import NO_ORIGIN


class OfTable(NamedTuple):
    """The options of one table."""

    seed: str | None
    preset: str | None
    level: str | None
    changes: list[str] | None
    events: Path | None
    pretrain: str | None

    def refuse(self, path: Path) -> None:
        """Refuse these options for an export of whole runs.

        Raises:
            UsageError: one of them is given.
        """
        options = ("--seed", "--preset", "--level", "--set", "--events", "--pretrain")
        given = [option for option, value in zip(options, self, strict=True) if value not in (None, [])]
        if given:
            raise UsageError(
                f"{given[0]} is for one table of answers (.jsonl). {path} has the settings of its runs."
            )


def import_one(db: Database, path: Path, given: OfTable) -> Imported:
    """Import the run of a table.

    Raises:
        UsageError: a setting is missing or wrong.
        SetupError: the table cannot be read, or is of a run with other settings.
    """
    if given.seed is None:
        raise UsageError(
            f"{path}: one table of answers (format 1) has no seed and no config, so it is not a run by "
            "itself. Give those of its run, and it is lived again: --seed, --preset, --set, and its log by "
            f"--events. Or begin a new run with its answers: parenting start WORLD --from-answers {path}"
        )
    table = read_table(path, given.events)
    fields = _fields(table.lines[-1], given) | {"seed": given.seed}
    from parenting._process import settle
    from parenting.server.archive.format1_import import import_table  # torch takes a second to load

    settle()
    chosen = settings()
    try:
        fields |= weights_of(db, fields, chosen.weights, given.pretrain, NO_ORIGIN, quiet=False)
        with bar("ticks") as show:
            form, own = read_form(fields), (chosen.weights, chosen.bound)
            return import_table(db, table, form, *own, progress=show, most=chosen.runs)
    except InvalidFieldsError as error:
        raise UsageError("\n".join(said(field, fields, rule) for field, rule in error.fields)) from None


def _fields(line: Line, given: OfTable) -> dict[str, str]:
    """Return the settings as fields of the form: those that the table tells, and those given.

    Raises:
        UsageError: its level is not built in, and no file of it is given.
    """
    known = registry.WORLDS.get(line.world)
    if known is not None and given.level is None and line.level not in known.levels:
        raise UsageError(
            f"The level {line.level} of the table is not built in: give its file by --level. Built in are: "
            f"{', '.join(known.levels)}."
        )
    who = {"parent": line.parent} | ({"script": line.script} if line.script else {})
    shown = {"guidance_layout": line.guidance_layout, "practice": line.practice, "words": line.words}
    level = {} if known is None else level_of(line.world, given.level or line.level)
    return {
        "world": line.world,
        "preset": given.preset or "conservative",
        "remarks": "true" if line.remarks else "false",
        **who,
        **shown,
        **level,
        **changes_of(given.changes or []),
    }
