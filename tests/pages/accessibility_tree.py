"""Chromium's words for a screen reader, read from its accessibility tree by the DevTools protocol."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from playwright.sync_api import CDPSession, Page


@dataclass
class Node:
    """A part of the page: its role, its name, and its parts."""

    role: str
    name: str
    parts: list[Node] = field(default_factory=list)

    def all(self, role: str) -> Iterator[Node]:
        """Find all parts of a role within this one, in their order."""
        for part in self.parts:
            if part.role == role:
                yield part
            yield from part.all(role)


def tree(page: Page, session: CDPSession | None = None) -> Node:
    """Return the tree of a page, without what is hidden from screen readers."""
    session = session or page.context.new_cdp_session(page)
    found = session.send("Accessibility.getFullAXTree")["nodes"]
    nodes = {node["nodeId"]: _node(node) for node in found}
    for node in found:
        nodes[node["nodeId"]].parts = [nodes[one] for one in node["childIds"] if one in nodes]
    return nodes[found[0]["nodeId"]]


def _node(node: dict[str, Any]) -> Node:
    said = {
        key: "" if node["ignored"] else str(node.get(key, {}).get("value", "")) for key in ("role", "name")
    }
    return Node(said["role"], said["name"])


def sentences(page: Node) -> list[str]:
    """Return the items of the list that tells the board."""
    lists = [list(found.all("listitem")) for found in page.all("list")]
    said = [["".join(text.name for text in item.all("StaticText")) for item in items] for items in lists]
    return next(found for found in said if any("The board reaches" in text for text in found))


def cells(page: Node) -> list[list[str]]:
    """Return the names of the cells of the grid, row by row."""
    (grid,) = page.all("grid")
    return [[cell.name for cell in row.all("gridcell")] for row in grid.all("row")]
