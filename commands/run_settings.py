"""The settings of a run as options of a command: fields of the form, read and said in the command's words."""

from __future__ import annotations

import re
from math import isfinite
from pathlib import Path

from parenting.agent.config import FIELDS, Config
from parenting.commands.before_run import provide
from parenting.commands.errors import UsageError
from parenting.commands.level_file import chosen_level
from parenting.envs import registry
from parenting.envs.names import did_you_mean
from parenting.parents.grammar import ParentError, read_script
from parenting.server import new_run
from parenting.server.db import Database
from parenting.server.missing_weights import missing_weights
from parenting.server.run_form import FORM_FIELDS, read_form
from parenting.weights.origin import Origin

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?", re.I)
OPTIONS = ("world", "level", "level_text", "preset", "parent", "script", "seed", "goal", "finish", "name")
"""The settings of a run that are arguments or options of their own; `--set` sets the others."""


def weights_of(
    db: Database, given: dict[str, str], folder: Path, choice: str | None, origin: Origin, *, quiet: bool
) -> dict[str, str]:
    """Provide the pre-trained weights that the run lacks, or return the field by which it begins without.

    Raises:
        UsageError: they are missing, and nothing was chosen.
        InvalidFieldsError: a field cannot be read.
    """
    if origin.policy is not None:
        return {}
    lacking = missing_weights(read_form(given), folder, db)
    if lacking is None or provide(lacking, choice, folder, quiet=quiet):
        return {}
    return {new_run.PRETRAIN: "false"}


def parent_of(text: str) -> dict[str, str]:
    """Return the fields that say who answers.

    Raises:
        UsageError: the text names no parent that a worker can be.
    """
    if text == "human":
        return {"parent": text}
    try:
        return {"parent": "scripted", "script": read_script(text)}
    except ParentError as error:
        raise UsageError(f"--parent: {error} Or: human.") from None


def level_of(world: str, name_or_file: str | None) -> dict[str, str]:
    """Return the fields that say which level it is: the name of one that is built in, or a text."""
    found = chosen_level(world, name_or_file)
    built_in = name_or_file is None or name_or_file in registry.spec(world).levels
    return {"level": found.name} if built_in else {"level_text": found.text}


def changes_of(changes: list[str]) -> dict[str, str]:
    """Read `--set` as fields of the form.

    Raises:
        UsageError: names every change that is not one.
    """
    names = [name for name in FORM_FIELDS if name not in OPTIONS]
    hyperparameters = (*FIELDS, *Config.model_fields)
    known = {**{name: name for name in names}, **{name: f"config.{name}" for name in hyperparameters}}
    found: dict[str, str] = {}
    seen: set[str] = set()
    wrong: list[str] = []
    for change in changes:
        key, equals, value = change.partition("=")
        if not equals:
            wrong.append(f"--set: '{change}' is not KEY=VALUE. Write it as --set pace=5.")
        elif key in OPTIONS:
            option = "parent" if key == "script" else key
            wrong.append(f"--set: '{key}' has an option of its own: --{option}.")
        elif key not in known:
            hint = did_you_mean(key, known)
            wrong.append(f"--set: there is no setting '{key}'.{hint} There is: {', '.join(known)}.")
        elif not value.strip():
            wrong.append(f"--set: '{change}' has no value. Write it as --set {key}=VALUE, or leave it out.")
        elif (meant := FIELDS.get(key, key)) in seen:
            wrong.append(f"--set: '{key}' is given twice, or by two names. Give it once.")
        else:
            seen.add(meant)
            found[known[key]] = _as_json(value) if known[key].startswith("config.") else value
    if wrong:
        raise UsageError("\n".join(wrong))
    return found


def _as_json(value: str) -> str:
    """Write a value in JSON, which the form reads, where it is none or a number such as .5 and +0.5."""
    text = value.strip()
    if text.lower() == "none":
        return "null"
    if NUMBER.fullmatch(text) is None or not isfinite(float(text)):
        return value
    return str(int(text)) if text.lstrip("+-").isdigit() else repr(float(text))


def said(field: str, given: dict[str, str], rule: str) -> str:
    """Return what is wrong with a field, by the name and the value that the command was given."""
    value = given.get(field)
    told = field.removeprefix("config.")
    return f"{told}: {rule}" if value is None or "\n" in value else f"{told}={value}: {rule}"
