"""Where the program starts: `parenting` and `python -m parenting`.

It imports nothing at its top, so that Ctrl-C ends the program in the same way while its modules are loaded,
which takes up to some seconds, and while a command runs: with 130, as a shell does, and without a traceback.
"""

import sys


def main() -> None:
    """Load the command line and run it."""
    try:
        from parenting.commands.main import app

        app()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
