"""`parenting worker`: raise the agents of the database's runs."""

from __future__ import annotations

from commands.lifeline import follow
from commands.said import plainly, settings
from server.log import set_up_log


def worker() -> None:
    """Raise the agents of the database's runs until Ctrl-C; goes on exactly where an earlier worker was.

    Example: parenting worker
    """
    follow()
    with plainly():
        chosen = settings()
        set_up_log(chosen.log_level)
        from server.worker import main  # loads torch, which takes a second: settings are checked first

        main(chosen)
