"""Backups: copies of the database that are whole, checked and never in place of another file unasked.

`copies` copies and checks a SQLite file while others write to it, `dumps` does the same for PostgreSQL by its
own tools. `making` writes a backup under its name, `restoring` puts one in place of a database that nobody
uses, `before_migrating` keeps a copy of what a migration is about to change.
"""
