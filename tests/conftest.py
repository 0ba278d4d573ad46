"""Fixtures that every test shares.

Keep this file small: a fixture for one folder belongs in that folder's conftest.py.
"""

import asyncio
import gc
import os
import shutil
from collections.abc import Generator, Iterator
from pathlib import Path

import hypothesis
import pytest
import structlog

from tests import access, slow, statements

FAULTS = Path(__file__).parent / "faults"

# Eight megabytes in each data folder would fill a disk; tests/server/store/test_ballast.py makes them.
os.environ.setdefault("PARENTING_BALLAST", "false")

access.use()
statements.share()

# Its own formatter prints every local variable, which takes a minute for an error deep in the application.
PLAIN = structlog.dev.ConsoleRenderer(colors=False, exception_formatter=structlog.dev.plain_traceback)
structlog.configure(processors=[*structlog.get_config()["processors"][:-1], PLAIN])

# A shared machine is sometimes slow. A property must not fail for that reason.
hypothesis.settings.register_profile("parenting", deadline=None)
hypothesis.settings.load_profile("parenting")


@pytest.fixture(scope="session")
def chromium_path() -> str:
    """The browser to test with. Without one a laptop skips the test, and CI fails it.

    Chromium without windows comes first: a page costs it a fifth of the time.
    """
    path = os.environ.get("PARENTING_CHROMIUM")
    path = path or shutil.which("chromium-headless-shell") or shutil.which("chromium")
    if path:
        return path
    reason = "no Chromium: install it (apt install chromium-headless-shell) or name it in PARENTING_CHROMIUM"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(autouse=True)
def without_the_loop_of_browsers(request: pytest.FixtureRequest) -> Iterator[None]:
    """Hide the loop of Playwright, which runs in this thread as long as its browser is open for later tests.

    Else a test without a browser could run no coroutine, if it comes after one with a browser.
    """
    running = None if "browser" in request.fixturenames else asyncio._get_running_loop()
    if running is None:
        yield
        return
    asyncio._set_running_loop(None)
    yield
    asyncio._set_running_loop(running)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage while the tests are collected: all that is made stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Have torch use one thread: two are slower here, and give other bits. pytest-xdist keeps the cores busy.

    This is not done when this file is read, for the process that only hands out tests needs no torch. What
    the modules have made by now stays; the garbage collector need not look through it again and again.
    """
    slow.mark_slow_cases(items)
    import torch

    torch.set_num_threads(1)
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave tests/faults to those who name it: they take minutes, and `make faults` runs them."""
    named = any("faults" in argument for argument in config.args)
    return True if collection_path == FAULTS and not named else None
