"""The files of the repository, for the tests that look at all of them."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parent.parent


def git_files(*options: str) -> list[str]:
    """Names of files from `git ls-files`, without the links in `parenting/`, which `LINKS` names.

    safe.directory lets CI run as another user than the one who cloned.
    """
    command = ["git", "-c", "safe.directory=*", "ls-files", "-z", *options]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [name for name in names.split("\0") if (ROOT / name).is_file()]


LINKS = sorted(f"parenting/{path.name}" for path in (ROOT / "parenting").iterdir() if path.is_symlink())
"""The links to the folders at the top, which give the packages their one name."""
