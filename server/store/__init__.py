"""The parts that differ between the stores: SQLite in a file, or PostgreSQL.

`server.db` is the handle that everything else uses. `refusals` translates what a store says when it cannot do
what it was asked; `sqlite` and `postgresql` open an engine. A database file is checked before it is used
(`check`), held against what is at its path in each transaction (`guard`, `held`), and noted in a mark beside
it (`high_water`), by which a lost log is noticed.
"""
