"""A new run from the text fields of a web form, or from the options of a command, which are the same."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun
from parenting.server.wrong_fields import messages

FORM_FIELDS = (
    "world",
    "level",
    "level_text",
    "parent",
    "script",
    "finish",
    "preset",
    "name",
    "seed",
    "goal",
    "pace",
    "guidance_layout",
    "practice",
    "words",
    "remarks",
)
AS_JSON = ("seed", "goal", "pace", "remarks")
"""Fields of the form whose text is a number or a truth value."""


def read_form(form: Mapping[str, str]) -> NewRun:
    """A new run from a web form's text; an empty field is an absent one, `config.p_guid` sets `p_guid`.

    Raises:
        InvalidFieldsError: names every wrong field, with a message each.
    """
    given = {name: text for name, text in form.items() if text.strip()}
    fields: dict[str, Any] = {name: given[name] for name in FORM_FIELDS if name in given}
    fields |= {name: _number(fields[name]) for name in AS_JSON if name in fields}
    changes = {name: text for name, text in given.items() if name.startswith("config.")}
    fields["config"] = {name.removeprefix("config."): _number(text) for name, text in changes.items()}
    try:
        return NewRun.model_validate(fields)
    except ValidationError as error:
        raise InvalidFieldsError(messages(error.errors())) from None


def _number(text: str) -> Any:
    """Read a form's text as a number, true, false or null; return the text if it is none of these."""
    try:
        value = json.loads(text)
    except ValueError:
        return text.strip()
    return text.strip() if isinstance(value, str | list | dict) else value
