"""`parenting access`: list who may come in. The commands below it make, open and revoke."""

from __future__ import annotations

from parenting.commands.access_list import AllOfThem, AsJson, command


def access(all_of_them: AllOfThem = False, as_json: AsJson = False) -> None:
    """List the tokens, links and sessions that are valid: what each may do, and until when.

    `parenting access open` prints an address that lets a browser in as the researcher, `access create` makes
    a link for a parent or a token for a program, and `access revoke` ends one. Secrets are stored as hashes,
    so nothing here can be used.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting access --json
    """
    command(all_of_them, as_json)
