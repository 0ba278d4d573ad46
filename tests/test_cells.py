"""Rows of CSV files that have more cells than columns, or fewer; blank last lines."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from parenting._cells import whole_rows
from parenting.audit import audit
from tests.test_audit import sound, write


def test_blank_lines_are_skipped_and_other_rows_are_whole() -> None:
    assert list(whole_rows(["a,b\n", "1,\n", "\n"])) == [{"a": "1", "b": ""}]
    assert list(whole_rows([])) == []
    for wrong, told in (
        (["a,b", "1"], "line 2: its cells are 1"),
        (["a,a"], "the column 'a' stands there twice"),
    ):
        with pytest.raises(ValueError, match=told):
            list(whole_rows(wrong))


def test_blank_last_lines_are_skipped_and_a_cell_too_many_is_named(tmp_path: Path) -> None:
    write(tmp_path, sound())
    told = json.loads((manifest := tmp_path / "manifest.json").read_text())

    def longer(name: str, more: bytes) -> list[str]:
        blob = (tmp_path / name).read_bytes() + more
        (tmp_path / name).write_bytes(blob)
        told["files"][name] |= {"sha256": hashlib.sha256(blob).hexdigest(), "bytes": len(blob)}
        manifest.write_text(json.dumps(told))
        return audit(tmp_path).problems

    assert longer("answers.jsonl", b"\n") == longer("metrics.csv", b"\n") == []
    assert "metrics.csv: line " in (said := longer("metrics.csv", b"1," * 99 + b"1\n")[0])
    assert "its cells are 100, the columns" in said
