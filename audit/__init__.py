"""The auditor of exports: it recomputes hashes, counts, chains and X from the files alone.

It imports the standard library and nothing of Parenting, so it repeats no error of the server's code
(import-linter holds it to that). It runs by itself: `python -m parenting.audit STUDY.zip`.
"""

from parenting.audit.report import Report, audit

__all__ = ["Report", "audit"]
