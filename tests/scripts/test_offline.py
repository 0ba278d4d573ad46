"""scripts/offline.py finds every way in which a page can load from another host."""

from pathlib import Path

import pytest

from scripts.offline import foreign, main


@pytest.mark.parametrize(
    "markup",
    [
        '<script src="https://cdn.example/x.js"></script>',
        '<link rel="stylesheet" href="//fonts.example/x.css">',
        '<img src="http://example.org/x.png">',
        '<p style="background: url(https://example.org/x.png)">',
    ],
)
def test_a_load_from_another_host_is_found(tmp_path: Path, markup: str) -> None:
    (tmp_path / "page.html").write_text(f"<html>{markup}</html>")
    assert len(foreign(tmp_path)) == 1
    assert main(str(tmp_path)) == 1


def test_a_style_sheet_that_imports_fonts_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.css").write_text('@import "https://fonts.example/x.css";')
    assert foreign(tmp_path) == ["a.css: https://fonts.example/x.css"]


def test_links_and_own_files_are_fine(tmp_path: Path) -> None:
    own = '<a href="https://arxiv.org/abs/1902.06766">paper</a><script src="_static/x.js"></script>'
    (tmp_path / "page.html").write_text(
        f'<html><link rel="canonical" href="https://example.org/">{own}</html>'
    )
    assert main(str(tmp_path)) == 0


def test_an_empty_folder_is_not_a_site(tmp_path: Path) -> None:
    assert main(str(tmp_path)) == 1
