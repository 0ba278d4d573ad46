"""The transfer of a whole database from one store to another, such as from SQLite to PostgreSQL and back.

`copying` does it, `ends` opens the source and the target, `rows` reads and writes rows and their digests,
`numbers` keeps deleted numbers from being given again.
"""
