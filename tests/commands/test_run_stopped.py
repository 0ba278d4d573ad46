"""`parenting run` on a terminal: progress from other processes while they train, and Ctrl-C."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys

import pytest

STYLE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
"""Sequences that a terminal takes as colours and movements."""
RUN = "from parenting.commands.main import app; app()"
ENDLESS = ("--trials", "4", "--workers", "2", "--until", "ticks:1000000", "--max-ticks", "1000000")


def read(terminal: int) -> str:
    """The text on a terminal by now; nothing once its program is gone."""
    try:
        return os.read(terminal, 65536).decode(errors="replace")
    except OSError:  # Linux's way to say so
        return ""


@pytest.mark.faults
def test_progress_of_both_processes_then_ctrl_c_leaves_nobody() -> None:
    """It starts three programs that load torch, which takes several seconds."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", RUN, "run", "unsafe-exploration", *ENDLESS]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, start_new_session=True)
    os.close(theirs)
    said = ""
    try:
        while not re.search(r"0/4 tick [1-9]", STYLE.sub("", said)):
            more = read(ours)
            assert more, said
            said += more
        os.killpg(program.pid, signal.SIGINT)  # as a terminal does
        while more := read(ours):
            said += more
        out, _ = program.communicate()  # until no child holds its standard output open any more
        assert program.returncode == 130, said
        assert "Stopped." in said
        assert "Traceback" not in said
        assert out == b""
    finally:
        os.close(ours)
        if program.poll() is None:
            os.killpg(program.pid, signal.SIGKILL)
        program.wait()
