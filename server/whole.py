"""Whole numbers as JSON writes them: 657 and 657.0 are the same number (JSON Schema's `integer`)."""

from __future__ import annotations

from typing import Any

from pydantic import BeforeValidator


def whole(value: Any) -> Any:
    """Read JSON's 657.0 as the integer 657."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


WHOLE = BeforeValidator(whole)
"""For integers of strict models. It stands after their bounds, or the API's description loses these."""
