"""No module imports itself through others, not even for type checkers."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest


def ordered(package: str) -> list[str]:
    """The modules of a package, each after all that it imports.

    Raises:
        CycleError: there is no such order; the error has the modules of a circle.
    """
    # without a cache, which would go by the name of the package alone
    graph = grimp.build_graph(package, exclude_type_checking_imports=False, cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    return list(TopologicalSorter(imports).static_order())


def test_there_is_no_circle() -> None:
    modules = ordered("parenting")
    assert {"parenting.agent.parenting", "parenting.experiments.figure2.report"} <= set(modules)


def test_a_circle_for_types_alone_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "circular"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "one.py").write_text("from circular import two\n")
    back = "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from circular.one import two\n"
    (package / "two.py").write_text(back)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CycleError, match=r"circular\.(one|two)"):
        ordered("circular")
