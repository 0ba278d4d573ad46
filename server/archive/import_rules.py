"""The rules of values in an export that is imported: those that a new run, question or answer keeps, too."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Any

from pydantic import TypeAdapter, ValidationError

from parenting.envs.people_text import plain
from parenting.server.answer_tables import PARENTS, SAID
from parenting.server.keeping import MOST_TAGS, Description, read_tag
from parenting.server.new_run import Name, PersonsName
from parenting.server.public_ids import is_public_id
from parenting.server.statuses import QueryStatus, RunStatus
from parenting.server.tables import KINDS

LARGEST = 2**31 - 1
"""The largest count or tick that every store keeps."""
LONGEST = 2000
"""Characters of a text of ours, such as the reason of a failure, at most."""
Rule = Callable[[Any], object]
Rules = Mapping[str, Rule]


def time(text: str) -> datetime:
    """Return the time that a text tells, in UTC.

    Raises:
        ValueError: It is none.
    """
    try:
        found = datetime.fromisoformat(re.sub(r"Z$", "+00:00", text))
        if found.tzinfo is not None:
            return found.astimezone(UTC)
    except (ValueError, TypeError, OverflowError):
        pass
    raise ValueError("a time in UTC stands here, such as 2026-01-31T12:00:00.000000Z")


def _count(value: Any, least: int = 0) -> None:
    if type(value) is not int or not least <= value <= LARGEST:
        raise ValueError(f"a whole number from {least} to {LARGEST} stands here")


def _truth(value: Any) -> None:
    if not isinstance(value, bool):
        raise ValueError("true or false stands here")


def _word(known: Collection[str], value: Any) -> None:
    if value not in list(known):
        raise ValueError(f"one of these stands here: {', '.join(known)}")


def _public_id(value: Any) -> None:
    if not isinstance(value, str) or not is_public_id(value):
        raise ValueError("a public id stands here: 22 letters and digits")


def _text(value: Any) -> None:
    if not isinstance(value, str) or len(value) > LONGEST:
        raise ValueError(f"a text of at most {LONGEST} characters stands here")
    plain(value)


def _object(value: Any) -> None:
    if not isinstance(value, dict):
        raise ValueError("a JSON object stands here")


def _json(value: str) -> None:
    try:
        _object(json.loads(value))
    except (ValueError, RecursionError):
        raise ValueError("a JSON object as text stands here") from None


def _clip(value: Any) -> None:
    if (len(value.actions), len(value.frames)) != (value.length, value.length + 1):
        raise ValueError("its length is not that of its actions and frames")


def _tags(value: Any) -> None:
    tags = value.strip(",").split(",") if isinstance(value, str) and value else []
    if value != "".join(f",{tag}" for tag in tags) + "," * bool(tags):
        raise ValueError("tags stand between commas, such as ',pilot,group a,'")
    if len(tags) > MOST_TAGS:
        raise ValueError(f"at most {MOST_TAGS} tags are allowed here")
    if wrong := next((tag for tag in tags if read_tag(tag) != tag), None):
        raise ValueError(f"the tag {wrong!r} has blanks around it")


def _of(kind: Any) -> Rule:
    """Return the rule that pydantic has of a type."""
    return partial(TypeAdapter(kind).validate_python, strict=True)


def _unless_null(rule: Rule) -> Rule:
    return lambda value: None if value is None else rule(value)


SETTINGS: Rules = {
    "level": _of(Name),
    "preset": _of(Name),
    "name": _of(PersonsName | None),
    "description": _of(Description | None),
    "tags": _tags,
    "created": _unless_null(time),
    "status": partial(_word, list(RunStatus)),
    "reason": _unless_null(_text),
    "batch": _unless_null(_text),
    "optimal": _truth,
    "maturity": partial(_count, least=1),
    "trial": _unless_null(_count),
    **dict.fromkeys(("tick", "answers", "retracted", "skipped"), _count),
    **dict.fromkeys(("legend", "brief", "config"), _object),
    **dict.fromkeys(("milestones", "lesson", "versions", "origin"), _unless_null(_object)),
}
"""The rules of a run in the manifest, besides those of `NewRun`."""
ROWS: dict[str, Rules] = {
    "questions.jsonl": {
        "question": _public_id,
        "kind": partial(_word, KINDS),
        "status": partial(_word, list(QueryStatus)),
        "put_back": _truth,
        "asked": time,
        "leased": _unless_null(time),
        **dict.fromkeys(("tick", "maturity", "votes"), _count),
        **dict.fromkeys(("withdrawn_tick", "policy_stage", "policy_gradient_steps"), _unless_null(_count)),
        **dict.fromkeys(("left", "right"), _clip),
    },
    "answers.jsonl": {
        "number": partial(_count, least=1),
        "question": _public_id,
        "by": partial(_word, PARENTS),
        "choice": _unless_null(partial(_word, SAID)),
        "pseudonym": _of(PersonsName | None),
        "received": time,
        "standing": _truth,
        **dict.fromkeys(("supersedes", "applied_tick", "replays"), _unless_null(_count)),
    },
    "events.csv": {
        "kind": _text,
        "created": time,
        "applied_tick": _unless_null(_count),
        "payload": _json,
    },
    "metrics.csv": {"tick": _count, "more": _unless_null(_json)},
}
"""The rules of each table's rows, besides the types of its columns."""


def wrong_value(rules: Rules, of: Mapping[str, Any]) -> tuple[str, Any, str] | None:
    """Return the first value that breaks a rule, as field, value and sentence; None if all are right."""
    return next(_wrong_values(rules, of), None)


def _wrong_values(rules: Rules, of: Mapping[str, Any]) -> Iterator[tuple[str, Any, str]]:
    for name, rule in rules.items():
        try:
            rule(of[name])
        except KeyError:
            yield name, None, "it is missing"
        except ValidationError as error:
            yield name, of[name], error.errors()[0]["msg"].removeprefix("Value error, ")
        except (ValueError, TypeError, AttributeError) as error:
            yield name, of[name], "it is missing" if of[name] is None else str(error)


def first_of(error: ValidationError) -> str:
    """Return the middle of a sentence on the first value that a model refuses: its field, itself and why."""
    first = error.errors(include_url=False)[0]
    field, missing = ".".join(map(str, first["loc"])) or "it", first["type"] == "missing"
    value = None if missing or not first["loc"] else first["input"]
    return shown(field, value, "it is missing" if missing else first["msg"].removeprefix("Value error, "))


def shown(field: str, value: Any, said: str) -> str:
    """Return the middle of a sentence on a wrong value; a long one is cut."""
    text = "" if value is None else f" {ascii(value)[:60]}:"
    return f"{field}:{text} {said.rstrip('.')}"
