"""The key file: made once, its owner's alone; a proof is good for one port and for a short time."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from parenting.server.access.key import FILE, SECONDS, holds, make_key, proof, read_key
from parenting.server.errors import SetupError

NOW = 1_800_000_000.0


def test_it_is_made_once_and_read_by_its_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    assert read_key(folder) is None
    made = make_key(folder)
    assert len(made) == 64
    assert make_key(folder) == read_key(folder) == made
    assert stat.S_IMODE((folder / FILE).stat().st_mode) == 0o600
    assert [file.name for file in folder.iterdir()] == [FILE], "nothing is left over"


def test_rights_that_others_have_are_taken_away(tmp_path: Path) -> None:
    make_key(tmp_path)
    (tmp_path / FILE).chmod(0o644)
    make_key(tmp_path)
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600


def test_an_empty_file_is_told(tmp_path: Path) -> None:
    (tmp_path / FILE).touch()
    with pytest.raises(SetupError, match="Delete it"):
        make_key(tmp_path)


def test_a_folder_that_takes_no_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SetupError, match="Make the data folder writable"):
        make_key(tmp_path / "file" / "data")


def test_a_proof_is_good_for_its_port_and_its_time() -> None:
    shown = proof(b"key", 8765, NOW)
    assert b"key".hex() not in shown
    assert holds(b"key", 8765, shown, NOW)
    assert holds(b"key", 8765, shown, NOW + SECONDS)
    assert not holds(b"key", 8765, shown, NOW + SECONDS + 1), "too old"
    assert not holds(b"key", 8765, shown, NOW - SECONDS - 1), "of a time to come"
    assert not holds(b"key", 8766, shown, NOW), "shown to another program's port, and brought here"
    assert not holds(b"another", 8765, shown, NOW)
    assert not holds(b"key", None, shown, NOW)


@pytest.mark.parametrize("text", ["", "local", "local..", "local.1.2", "local.x." + "0" * 64, "é" * 70])
def test_what_has_another_form_is_none(text: str) -> None:
    assert not holds(b"key", 8765, text, NOW)
