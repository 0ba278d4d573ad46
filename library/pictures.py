"""Pictures that a notebook shows, and the same as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from urllib.parse import quote


@dataclass(frozen=True, repr=False)
class Drawing:
    """Pictures, and the same as text.

    Attributes:
        pictures: Each picture as the text of an SVG file, in light and dark colours.
        text: The same as rows of glyphs; it is the representation in a terminal.
    """

    pictures: Sequence[str]
    text: str

    def save(self, path: str | Path) -> Path:
        """Write the picture to an SVG file.

        Raises:
            ValueError: There is not exactly one picture.
        """
        if len(self.pictures) != 1:
            raise ValueError(
                f"save writes one picture, and here are {len(self.pictures)}. Show one thing alone."
            )
        Path(path).write_text(self.pictures[0], encoding="utf-8")
        return Path(path)

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        """Return images: inside them, styles and names of a picture do not meet those of the notebook."""
        images = [
            f'<img alt="{escape(self.text, quote=True)}" src="data:image/svg+xml;utf8,{quote(svg)}">'
            for svg in self.pictures
        ]
        return "\n".join(images)
