"""Requests are read strictly: no field of a JSON body stands twice, no unknown parameter is passed over.

Both would be ignored in silence otherwise, and what a client meant would be lost.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.dependencies.models import Dependant
from pydantic import BeforeValidator
from starlette.exceptions import HTTPException

from parenting.server.errors import InvalidFieldsError

Handler = Callable[[Request], Coroutine[Any, Any, Response]]

UNKNOWN = "Extra inputs are not permitted"
"""Pydantic's words for an unknown parameter, where an address takes any."""
_DIGITS = re.compile(r"-?[0-9]+")


class TwiceError(HTTPException):
    """A field stands twice in one object. The framework passes errors of this class on as they are."""

    def __init__(self, field: str) -> None:
        self.field = field
        super().__init__(422)

    @property
    def said(self) -> InvalidFieldsError:
        """Return the same as an error of ours."""
        name = self.field if self.field.isprintable() else "body"
        return InvalidFieldsError([(name, "It stands twice in this body. Send it once.")])


class StrictRequest(Request):
    """A request whose JSON has each field of an object once."""

    async def json(self) -> Any:
        """Return the body, read once.

        Raises:
            TwiceError: a field stands twice.
        """
        if not hasattr(self, "_json"):
            self._json = json.loads(await self.body(), object_pairs_hook=_once)
        return self._json


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        ((name, _),) = Counter(name for name, _ in pairs).most_common(1)
        raise TwiceError(name)
    return found


def strictly(dependant: Dependant, handle: Handler) -> Handler:
    """Return a handler of strict requests.

    Args:
        dependant: What the route takes. Where it has parameters, they are of an `api.lists.Part`, which
            refuses others.
        handle: What it does.
    """
    takes_any = _takes_parameters(dependant)

    async def strict(request: Request) -> Response:
        scope = request.scope
        if scope["query_string"] and not takes_any and scope["path"].startswith("/api/"):
            refuse_parameters(request)
        return await handle(StrictRequest(scope, request.receive))

    return strict


def _takes_parameters(dependant: Dependant) -> bool:
    return bool(dependant.query_params) or any(map(_takes_parameters, dependant.dependencies))


def refuse_parameters(request: Request) -> None:
    """Refuse the parameters of an address that takes none.

    Raises:
        InvalidFieldsError: names each of them.
    """
    if names := list(request.query_params.keys()):
        raise InvalidFieldsError([(name, UNKNOWN) for name in names])


def _digits(written: Any) -> Any:
    if isinstance(written, str) and not _DIGITS.fullmatch(written):
        raise ValueError("Write a whole number in digits alone, such as 20.")
    return written


DIGITS = BeforeValidator(_digits)
"""For whole numbers among parameters: as in a path, they are digits and nothing else."""
