"""CITATION.cff says of the software what pyproject.toml says, and of the paper what the README says."""

import re
import tomllib
from typing import Any

import pytest
import yaml

from tests.tree import ROOT

REQUIRED = {"cff-version", "message", "title", "authors"}
"""By the Citation File Format 1.2.0; a reference needs a `type`, a `title` and `authors`."""


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    read = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert isinstance(read, dict)
    return read


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    project: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return project


def test_it_has_what_the_format_asks_for(citation: dict[str, Any]) -> None:
    assert set(citation) >= REQUIRED
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] == "software"
    assert all(isinstance(citation[name], str) for name in ("message", "title", "version", "license"))


def test_the_software_is_that_of_the_project(citation: dict[str, Any], project: dict[str, Any]) -> None:
    assert citation["title"].lower() == project["name"]
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"]
    assert citation["abstract"] == project["description"]
    assert citation["keywords"] == project["keywords"]
    assert citation["authors"] == project["authors"]


def test_the_paper_is_that_of_the_readme(citation: dict[str, Any]) -> None:
    (paper,) = citation["references"]
    entry = dict(
        re.findall(r"^ +(\w+) += \{(.+)\},?$", (ROOT / "README.md").read_text("utf-8"), re.MULTILINE)
    )
    assert paper["type"] == "article"
    assert paper["title"] == entry["title"]
    assert str(paper["year"]) == entry["year"]
    assert [f"{author['family-names']}, {author['given-names']}" for author in paper["authors"]] == entry[
        "author"
    ].split(" and ")
    assert [one["value"] for one in paper["identifiers"]] == [f"arXiv:{entry['eprint']}"]
    assert paper["url"].endswith(entry["eprint"])


def test_the_readme_leads_to_it() -> None:
    section = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Licence and citation")[2]
    assert "(CITATION.cff)" in section
