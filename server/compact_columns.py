"""The columns of clips and figures: they are stored as lists, and read in whichever form they stand."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Dialect

from parenting.server.columns import Json
from parenting.server.compact import shorten_clips, shorten_figures, whole_clips, whole_figures
from parenting.server.compact_lists import clips_of, figures_of, list_clips, list_figures


class Clips(Json):
    """The clips of a question."""

    cache_ok = True

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        """To the shortest form that gives it back."""
        found = super().process_bind_param(value, dialect)
        return (list_clips(found) or shorten_clips(found)) if isinstance(found, dict) else found

    def process_result_value(self, value: Any, dialect: Dialect) -> Any:
        """Back to the whole."""
        if isinstance(value, list):
            return clips_of(value)
        return whole_clips(value) if isinstance(value, dict) else value


class Figures(Json):
    """Figures of which those of `names` always come together, in this order."""

    cache_ok = True

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        super().__init__()

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        """To the shortest form that gives it back."""
        found = super().process_bind_param(value, dialect)
        if not isinstance(found, dict):
            return found
        return list_figures(self.names, found) or shorten_figures(self.names, found)

    def process_result_value(self, value: Any, dialect: Dialect) -> Any:
        """Back to the whole."""
        if isinstance(value, list):
            return figures_of(self.names, value)
        return whole_figures(self.names, value) if isinstance(value, dict) else value
