"""`python -m parenting.audit FOLDER|ZIP`: print the report, and exit with 0 if nothing was found, else 1."""

from __future__ import annotations

import sys
from pathlib import Path

from parenting.audit import audit

if len(sys.argv) != 2:
    sys.exit("Name one folder or zip: python -m parenting.audit study.zip")
found = audit(Path(sys.argv[1]))
print(found)
sys.exit(0 if found.sound else 1)
