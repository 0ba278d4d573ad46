"""The parts that differ between the stores: SQLite in a file, or PostgreSQL.

`server.db` is the handle that everything else uses. `refusals` translates what a store says when it cannot do
what it was asked; `sqlite` and `postgresql` open an engine.
"""
