"""`import parenting` costs nothing: each public name is loaded on its first use."""

import subprocess
import sys

import pytest

import parenting as pt
from tests.tree import ROOT

HEAVY = ("torch", "numpy", "gymnasium", "fastapi", "sqlalchemy", "pydantic", "rich")


def in_a_fresh_process(code: str) -> str:
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_the_import_alone_loads_no_library() -> None:
    code = f"import parenting, sys; print([name for name in {HEAVY} if name in sys.modules])"
    assert in_a_fresh_process(code) == "[]"


def test_dir_lists_every_name_and_loads_none() -> None:
    code = (
        "import parenting as pt, sys; assert set(pt.__all__) <= set(dir(pt));"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    assert in_a_fresh_process(code) == "[]"


def test_config_and_worlds_load_neither_torch_nor_the_server() -> None:
    code = (
        "import parenting as pt, sys; pt.Config(); pt.PRESETS;"
        "print([name for name in ('torch', 'gymnasium', 'fastapi', 'sqlalchemy') if name in sys.modules])"
    )
    assert in_a_fresh_process(code) == "[]"


@pytest.mark.slow
def test_training_by_the_scripted_parent_loads_neither_gymnasium_nor_the_server() -> None:
    code = (
        "import parenting as pt, sys; pt.train('unsafe-exploration', until='ticks:1', progress=False);"
        "print([name for name in ('gymnasium', 'fastapi', 'sqlalchemy') if name in sys.modules])"
    )
    assert in_a_fresh_process(code) == "[]"


@pytest.mark.parametrize("name", pt.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name: str) -> None:
    value = getattr(pt, name)
    assert value is getattr(pt, name)
    if name != "PRESETS":  # a dictionary has no docstring of its own
        assert value.__doc__, name


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
        getattr(pt, "no_such_name")  # noqa: B009 (mypy finds it by itself where it is written out)


def test_the_names_for_type_checkers_are_the_names_that_are_loaded() -> None:
    """mypy sees the imports under TYPE_CHECKING; __getattr__ reads a table. Both name the same modules."""
    import ast

    tree = ast.parse((ROOT / "parenting/__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    found = {
        alias.name: (node.module or "").removeprefix("parenting.")
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert found == {**pt._MODULES, "testing": "library"}
    assert sorted(found) == sorted(pt.__all__)
