"""`parenting parents`: the parents that `--parent` names, with their parameters."""

from __future__ import annotations

import inspect
import json
from typing import Annotated, Any

import typer

from parenting.commands.errors import UsageError
from parenting.commands.printing import say
from parenting.parents.errors import PARTS, Part
from parenting.parents.grammar import INSTALLED, ParentError, ParentSpec, read_parent


def parents(
    as_json: Annotated[bool, typer.Option("--json", help="Print them as JSON and nothing else.")] = False,
) -> None:
    """List the parents who answer by a rule: the paper's (Sec. 3.1.3), who never errs, and those who err.

    `--parent` of run, start and answer takes them: a name with its parameters, several joined by +. Those of
    installed packages stand at the end.

    Example: parenting parents, then parenting run side-effects --parent boltzmann:beta=2+tiring
    """
    installed = {name: part for name in INSTALLED if (part := INSTALLED.get(name)) is not None}
    found = {**PARTS, **installed}
    if as_json:
        say(json.dumps([_plain(name, part) for name, part in found.items()], indent=2))
        return
    say("\n".join(_lines(name, part) for name, part in found.items()))


def chosen_parent(text: str) -> ParentSpec:
    """Return the parent that an option names.

    Raises:
        UsageError: it names none.
    """
    try:
        return read_parent(text)
    except ParentError as error:
        raise UsageError(f"--parent: {error}") from None


def _plain(name: str, part: type[Part]) -> dict[str, Any]:
    parameters = [
        {"name": parameter, "default": field.default, "description": field.description}
        for parameter, field in part.model_fields.items()
    ]
    return {"name": name, "summary": _summary(part), "judges": part.judges, "parameters": parameters}


def _lines(name: str, part: type[Part]) -> str:
    lines = [f"{name}: {_summary(part)}"]
    for parameter, field in part.model_fields.items():
        lines.append(f"    {parameter}={field.default}  {field.description}")
    return "\n".join(lines)


def _summary(part: type[Part]) -> str:
    return (inspect.getdoc(part) or "").split("\n")[0]
