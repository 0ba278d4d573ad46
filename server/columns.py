"""The types of columns. Reading never raises: a value that cannot be read becomes a `Damaged` one.

So a row that cannot be read costs that row, and not the list that it stands in. Whoever uses a damaged value
meets a `DamagedRowError`, a sentence that names the column; `server.damage` asks rows before they are used.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Generic, NoReturn, TypeVar

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    DateTime,
    Dialect,
    Double,
    Integer,
    LargeBinary,
    MetaData,
    Text,
    TypeDecorator,
)
from sqlalchemy.types import TypeEngine

from parenting.server.errors import DamagedRowError

E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")
UNREADABLE = (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError)
"""Errors that a stored value causes which is not what its column holds."""


DIGITS = re.compile("([0-9a-f]{2})+")
"""Text that stands for bytes."""


class Damaged:
    """A stored value that cannot be read. Every use of it raises `DamagedRowError`."""

    def __init__(self, reason: str, place: str = "a column") -> None:
        self._reason, self._place = reason, place

    @property
    def reason(self) -> str:
        """Return the end of a sentence that begins with the column's name."""
        return self._reason

    def _refuse(self, *_: object) -> NoReturn:
        raise DamagedRowError(f"A stored value cannot be read: {self._place} {self._reason}.")

    def __getattr__(self, name: str) -> Any:
        """Refuse to be used; names of Python's own protocols are absent."""
        if name.startswith("_"):
            raise AttributeError(name)
        self._refuse()

    def __repr__(self) -> str:
        """Name the column, for logs and messages of validators."""
        return f"<damaged: {self._place} {self._reason}>"

    __hash__ = object.__hash__
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __bool__ = __len__ = __iter__ = __contains__ = __getitem__ = __str__ = __format__ = _refuse
    __int__ = __float__ = __index__ = __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _refuse


def loads(text: str | bytes) -> Any:
    """Read JSON as the standard has it, without NaN and halves of surrogate pairs; else `Damaged`."""
    try:
        whole = text if isinstance(text, str) else bytes(text).decode()
        found = _DECODER.decode(whole)
        if "\\u" in whole:
            json.dumps(found, ensure_ascii=False).encode()  # refuses halves of surrogate pairs
        return found
    except UNREADABLE:
        return Damaged("is not JSON")


def decoded(text: bytes) -> str | bytes:
    """Return SQLite's text; bytes that are not text stay bytes, which no column takes for sound."""
    try:
        return text.decode()
    except UnicodeDecodeError:
        return text


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(name)


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


class Checked(TypeDecorator[T], Generic[T]):
    """A column that holds values of one type, whatever the store lets in."""

    impl: TypeEngine[Any] | type[TypeEngine[Any]] = Text
    cache_ok = True
    kind: type | tuple[type, ...]
    noun: str
    place = "a column"

    def result_processor(self, dialect: Dialect, coltype: Any) -> Callable[[Any], Any]:
        """Read a value, or say that it cannot be read."""
        inner = super().result_processor(dialect, coltype)
        damaged = Damaged(f"is not {self.noun}", self.place)

        def read(value: Any) -> Any:
            try:
                found = inner(value) if inner is not None else value
            except UNREADABLE:
                return damaged
            return found if found is None or self.sound(found) else damaged

        return read

    def sound(self, found: Any) -> bool:
        """Return whether a value is one of this column's."""
        return isinstance(found, self.kind)

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        """Refuse to store what could not be read."""
        if isinstance(value, Damaged):
            value._refuse()
        return value

    def compare_values(self, x: Any, y: Any) -> bool:
        """Return whether two values are equal; a damaged one equals none."""
        if isinstance(x, Damaged) or isinstance(y, Damaged):
            return x is y
        return bool(super().compare_values(x, y))


class Words(Checked[str]):
    """Text."""

    cache_ok = True
    kind, noun = str, "text"


class Whole(Checked[int]):
    """A whole number."""

    cache_ok = True
    # SQLite counts only what is called INTEGER.
    impl: TypeEngine[Any] | type[TypeEngine[Any]] = BigInteger().with_variant(Integer, "sqlite")
    kind, noun = int, "a whole number"


class Big(Whole):
    """A whole number of 64 bits, named so in every store."""

    cache_ok = True
    impl = BigInteger


class Real(Checked[float]):
    """A finite number."""

    cache_ok = True
    impl = Double
    kind, noun = (int, float), "a finite number"

    def sound(self, found: Any) -> bool:
        """Return whether it is a finite number."""
        return isinstance(found, self.kind) and math.isfinite(found)


class Flag(Checked[bool]):
    """True or false."""

    cache_ok = True
    impl = Boolean
    kind, noun = bool, "a truth value"

    def result_processor(self, dialect: Dialect, coltype: Any) -> Callable[[Any], Any]:
        """Read a truth value; the driver would take any text for true."""
        read = super().result_processor(dialect, coltype)
        damaged = Damaged(f"is not {self.noun}", self.place)
        return lambda value: read(value) if value is None or type(value) in (bool, int) else damaged


class Blob(Checked[bytes]):
    """Bytes."""

    cache_ok = True
    impl = LargeBinary
    kind, noun = bytes, "bytes"


class Hex(Checked[str]):
    """Hexadecimal digits, of a hash or a salt, stored as the bytes that they stand for.

    SQLite's rows of before revision 0031 hold the digits as text. Any other text is stored as it is;
    PostgreSQL, whose column holds bytes alone, puts `TEXT` before it.
    """

    cache_ok = True
    impl: TypeEngine[Any] | type[TypeEngine[Any]] = LargeBinary().with_variant(Text, "sqlite")
    kind, noun = str, "text"
    TEXT = b"text:"

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        """To bytes."""
        value = super().process_bind_param(value, dialect)
        if not isinstance(value, str):
            return value
        if DIGITS.fullmatch(value) is not None and not value.startswith(self.TEXT.hex()):
            return bytes.fromhex(value)
        return value if dialect.name == "sqlite" else self.TEXT + value.encode()

    def process_result_value(self, value: Any, dialect: Dialect) -> Any:
        """Back to digits."""
        if not isinstance(value, bytes):
            return value
        return value.removeprefix(self.TEXT).decode() if value.startswith(self.TEXT) else value.hex()


class Json(Checked[dict[str, Any]]):
    """A JSON object."""

    cache_ok = True
    impl = JSON(none_as_null=True)
    kind, noun = dict, "a JSON object"


class Utc(Checked[datetime]):
    """A time, stored as UTC without a zone and read back as UTC, in every database alike."""

    cache_ok = True
    impl = DateTime(timezone=False)
    kind, noun = datetime, "a time"

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To UTC, without its zone."""
        value = super().process_bind_param(value, dialect)
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Back to UTC, with its zone."""
        return None if value is None else value.replace(tzinfo=UTC)


class Word(Checked[E], Generic[E]):
    """A member of an enumeration, stored as its text."""

    cache_ok = True
    kind = StrEnum

    def __init__(self, words: type[E]) -> None:
        self.words, self.noun = words, f"one of {', '.join(words)}"
        super().__init__()

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        """To text."""
        value = super().process_bind_param(value, dialect)
        return None if value is None else str(value)

    def process_result_value(self, value: str | None, dialect: Dialect) -> E | None:
        """Back to the member."""
        return None if value is None else self.words(value)


class OneOf(Checked[str]):
    """One of a few words, as text."""

    cache_ok = True
    kind = str

    def __init__(self, words: tuple[str, ...]) -> None:
        self.words, self.noun = words, f"one of {', '.join(words)}"
        super().__init__()

    def sound(self, found: Any) -> bool:
        """Return whether it is one of the words."""
        return found in self.words


def name_places(metadata: MetaData) -> None:
    """Tell each column's type the column's name, for its messages."""
    for table in metadata.tables.values():
        for column in table.columns:
            if isinstance(column.type, Checked):
                column.type = column.type.copy()
                column.type.place = f"{table.name}.{column.name}"
