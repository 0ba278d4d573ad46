"""Bytes of a level's file as text: UTF-8, UTF-16 and UTF-32, with byte order mark or without.

Files are opened elsewhere; nothing here does.
"""

from __future__ import annotations

from contextlib import suppress

from parenting.envs.people_text import read_name

FILE_BYTES = 2_000_000
"""Bytes of a file that holds levels, at most."""
BOMS = (
    (b"\xef\xbb\xbf", "utf-8"),
    (b"\xff\xfe\x00\x00", "utf-32-le"),
    (b"\x00\x00\xfe\xff", "utf-32-be"),
    (b"\xff\xfe", "utf-16-le"),
    (b"\xfe\xff", "utf-16-be"),
)
"""The byte order mark of each encoding; a longer one stands before one that it begins with."""


def decode(blob: bytes) -> tuple[str, tuple[str, ...]]:
    """Return the text of a file's bytes, and a word on its encoding unless that is UTF-8.

    Raises:
        ValueError: There are too many, or they are not text in one of the encodings.
    """
    if len(blob) > FILE_BYTES:
        raise ValueError(f"a file of levels has at most {FILE_BYTES} bytes, and this one has more")
    encoding = encoding_of(blob)
    mark = next((bom for bom, known in BOMS if known == encoding and blob.startswith(bom)), b"")
    return _read(blob[len(mark) :], encoding)


def encoding_of(blob: bytes) -> str:
    """Return the encoding that bytes are most likely in: by their mark, or by where their zeros stand."""
    for bom, encoding in BOMS:
        if blob.startswith(bom):
            return encoding
    if b"\0" not in blob:
        return "utf-8"
    for encoding in ("utf-32-le", "utf-32-be"):
        with suppress(UnicodeDecodeError):
            blob.decode(encoding)  # hardly any other bytes are
            return encoding
    even, odd = blob[::2].count(0), blob[1::2].count(0)
    # Signs and Latin letters have a zero in every second byte, and the art of a level is of these.
    for zeros, others, encoding in ((odd, even, "utf-16-le"), (even, odd, "utf-16-be")):
        if 8 * zeros >= len(blob) - 1 and zeros > 4 * others:
            return encoding
    return "utf-8"


def _read(blob: bytes, encoding: str) -> tuple[str, tuple[str, ...]]:
    name = "-".join(encoding.upper().split("-")[:2])
    try:
        text = blob.decode(encoding)
    except UnicodeDecodeError as error:
        line = blob.count(b"\n", 0, error.start) + 1
        raise ValueError(f"byte {error.start + 1}, on line {line}, is not {name}; save it as UTF-8") from None
    return text, () if encoding == "utf-8" else (f"the text was read as {name}",)


def name_by_file(stem: str) -> str | None:
    """Return the name of a level in a file that names none: the file's own, if it can be a name."""
    try:
        return read_name(stem)
    except ValueError:
        return None
