"""Numbers as pages write them: "7,236" and "0.1235". web/static/numbers.js writes them in the same way."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Context

from parenting.server.languages import language

DIGITS = 4
"""Digits of a number that is not whole."""
NONE = "–"
THIN_SPACE = "\u202f"
"""It parts thousands in every language but English, some of which write a comma before tenths."""


def number(value: object, digits: int = DIGITS) -> str:
    """Return a number for people, with its thousands parted; a dash where there is none."""
    if isinstance(value, float) and not value.is_integer():
        text = f"{Context(prec=digits, rounding=ROUND_HALF_UP).create_decimal(value).normalize():,f}"
    elif isinstance(value, int | float):
        text = f"{int(value):,}"
    else:
        return value if isinstance(value, str) else NONE
    return text if language().tag == "en" else text.replace(",", THIN_SPACE)
