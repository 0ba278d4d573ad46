"""The option `--level`: names, files, pipes, standard input, texts, and one of several levels of a file."""

import io
import os
from pathlib import Path

import pytest

from parenting.commands.errors import UsageError
from parenting.commands.level_file import chosen_level
from tests.envs.test_level_text import POND, SECOND

WORLD = "unsafe-exploration"
TWO = f"; first\n{POND}\n; second\n{SECOND}"


def rows(text: str) -> tuple[str, ...]:
    return tuple(text.splitlines())


def test_a_pipe_is_read_as_a_file_is() -> None:
    for which, text in (("", POND), (":1", TWO), (":second", TWO)):
        out, into = os.pipe()
        with os.fdopen(into, "w") as pipe:
            pipe.write(text)
        expected = SECOND if which == ":second" else POND
        assert chosen_level(WORLD, f"/dev/fd/{out}{which}").rows == rows(expected)
        os.close(out)


def test_standard_input_is_read(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for argument, text in (("-", POND.encode("utf-16")), ("-:1", TWO.encode())):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text)))
        assert chosen_level(WORLD, argument).rows == rows(POND)
    assert capsys.readouterr().err == "standard input: the text was read as UTF-16.\n"


def test_a_text_is_a_level_and_what_is_cut_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    indented = "".join(f"  {row}\n" for row in rows(POND))
    assert chosen_level(WORLD, indented).rows == rows(POND)
    assert capsys.readouterr().err == "level: 2 blank columns left of the art were cut.\n"


def test_a_file_whose_name_holds_a_colon_is_that_file(tmp_path: Path) -> None:
    (tmp_path / "two").write_text(TWO)
    (tmp_path / "two:1").write_text(SECOND)
    assert chosen_level(WORLD, str(tmp_path / "two:1")).rows == rows(SECOND)
    assert chosen_level(WORLD, str(tmp_path / "two:first")).rows == rows(POND)


@pytest.mark.parametrize("file", ["two.txt", "C:two.txt", "a:b:c.txt"])
def test_names_and_paths_hold_colons_and_the_longest_file_is_meant(tmp_path: Path, file: str) -> None:
    (tmp_path / "a").write_text(POND)
    (tmp_path / "a:b").mkdir()
    path = tmp_path / file
    path.write_text(f"; part 1: pond\n{POND}\n; part 2: a:b\n{SECOND}")
    assert chosen_level(WORLD, f"{path}:part 2: a:b").rows == rows(SECOND)
    assert chosen_level(WORLD, f"{path}:1").rows == rows(POND)
    for which in ("part 2", "part 2: a", "b:c.txt", ""):
        said = f"no level is called '{which}' here. The levels are: 1 part 1: pond, 2 part 2: a:b"
        with pytest.raises(UsageError, match=said):
            chosen_level(WORLD, f"{path}:{which}")
    with pytest.raises(UsageError, match="a:b:d' is neither a level of"):
        chosen_level(WORLD, str(tmp_path / "b" / "a:b:d"))


def test_what_cannot_be_read_has_a_remedy(tmp_path: Path) -> None:
    file = tmp_path / "two.txt"
    file.write_text(TWO)
    said = f"--level: {file}, line 1, column 1: 2 levels are here, and one is wanted: 1 first, 2 second."
    with pytest.raises(UsageError) as caught:
        chosen_level(WORLD, str(file))
    assert str(caught.value) == f"{said} Choose one by its number or name, such as --level {file}:1."
    with pytest.raises(UsageError, match=r"no level is called '3' here. The levels are: 1 first, 2 second"):
        chosen_level(WORLD, f"{file}:3")
    with pytest.raises(UsageError, match=f"--level: {tmp_path} cannot be read as text: Is a directory.$"):
        chosen_level(WORLD, str(tmp_path))
    with pytest.raises(UsageError, match="'nowhere:1' is neither a level of unsafe-exploration"):
        chosen_level(WORLD, "nowhere:1")
    with pytest.raises(UsageError, match="at most 2000000 bytes"):
        chosen_level(WORLD, "/dev/zero")


def test_a_level_without_a_name_has_that_of_its_file(tmp_path: Path) -> None:
    bare = "WWWWW\nWA GW\nWWWWW\n"
    for file, text, name in (
        ("pond.txt", bare, "pond"),
        ("two.levels.txt", f"; first\n{bare}\n; \n{bare}", "two.levels"),
        ("\u200b.txt", bare, str(tmp_path / "\u200b.txt")),  # nobody could see that name
    ):
        (tmp_path / file).write_text(text, encoding="utf-8")
        which = ":2" if "two" in file else ""
        assert chosen_level("unsafe-exploration", f"{tmp_path / file}{which}").name == name
