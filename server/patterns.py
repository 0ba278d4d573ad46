"""The forms of texts in requests, as patterns, each with the sentence that says what to write."""

from __future__ import annotations

from parenting.server.finishes import KNOWN
from parenting.server.finishes import PATTERN as FINISH
from parenting.server.public_ids import PATTERN as PUBLIC_ID

CLIENT = r"^[A-Za-z0-9._:-]+$"
DATABASE = r"^[0-9a-f-]+$"
SHA256 = r"^[0-9a-f]{64}$"
METRICS = r"^[a-z_]{1,40}(,[a-z_]{1,40}){0,39}$"
LINE = r"^[^\r\n\t]*$"
TAG = r"^[^\r\n\t,]*$"

WRITE = {
    FINISH: f"Write {KNOWN}.",
    PUBLIC_ID: (
        "This is not a public id. Write the 22 letters and digits in its address, of a run or question."
    ),
    CLIENT: "Write letters, digits and . _ : - only, such as tab-1.",
    DATABASE: "This is not the id of a database. Write what `database` says in the run or question.",
    SHA256: "This is not a sha256. Write the 64 digits, 0 to f, that the upload of the policy returned.",
    METRICS: "Write names of metrics, with a comma and no blank between them, such as deaths,return.",
    LINE: "Write one line, without tabs.",
    TAG: "Write one line, without commas and tabs.",
}
"""The sentence for a text that does not match, by the pattern."""
