"""docs/glossary.md and the code: every entry leads to code, and every term of the code has an entry."""

import ast
import re
from pathlib import Path

import pytest

from parenting.agent.query import Choice, QueryKind
from tests.tree import ROOT

ROW = re.compile(r"^\| (?P<term>[^|]+) \| (?P<meaning>[^|]+) \| (?P<section>[^|]+) \| `(?P<code>[^`]+)` \|$")
LINES = (ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
ENTRIES = {found["term"]: found for line in LINES if (found := ROW.match(line))}
SECTION = re.compile(r"ours|2|2\.[1-4](, 2\.2)?|3\.1\.[1-4]|3\.2|3\.2\.1|3\.4|4\.1")

SAME = {
    "adam": "Adam",
    "architecture": "policy",
    "dataset": "X",
    "events": "operator",
    "forecast_chance": "forecast chance",
    "init": "agent",
    "learning": "direct policy learning",
    "parenting": "tick",
    "pretraining": "pre-training",
    "pretraining_loop": "pre-training",
    "pretraining_mazes": "pre-training",
    "state": "agent",
}
"""Modules of agent/ whose term is another word."""


def test_the_table_has_rows_and_each_line_of_it_is_one() -> None:
    table = [line for line in LINES if line.startswith("| ") and not line.startswith("| term |")]
    assert len(table) == len(ENTRIES) > 40


def test_terms_stand_in_alphabetical_order() -> None:
    assert list(ENTRIES) == sorted(ENTRIES, key=str.lower)


@pytest.mark.parametrize("term", ENTRIES)
def test_an_entry_is_one_sentence_with_a_section_and_leads_to_code(term: str) -> None:
    entry = ENTRIES[term]
    assert entry["meaning"].endswith(".")
    assert ". " not in entry["meaning"]
    assert all(SECTION.fullmatch(part) for part in re.split(r", Eq\.| and \(", entry["section"])[:1])
    path, _, name = entry["code"].partition("::")
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    defined = {node.name for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    assert not name or name in defined, f"{path} does not define {name}"


@pytest.mark.parametrize("module", sorted(path.stem for path in (ROOT / "agent").glob("[!_]*.py")))
def test_every_module_of_the_algorithm_has_an_entry(module: str) -> None:
    assert SAME.get(module, module) in ENTRIES


def test_every_kind_of_query_and_every_choice_is_explained() -> None:
    text = " ".join(entry["meaning"] for entry in ENTRIES.values())
    assert {kind.name.lower() for kind in QueryKind if kind} <= set(ENTRIES)
    assert all(f"*{choice.name.lower()}*" in text for choice in Choice if choice)


def test_a_term_is_used_where_it_leads() -> None:
    """A term that its own code never uses is not the code's word for the thing."""
    missing = [term for term, entry in ENTRIES.items() if not _used(term, entry["code"].partition("::")[0])]
    assert missing == []


def _used(term: str, path: str) -> bool:
    text = Path(ROOT / path).read_text(encoding="utf-8").lower().replace("_", " ").replace("-", " ")
    words = term.lower().replace("-", " ").split()
    return all(word[:4] in text for word in words)  # "pairing" is "pair" there
