"""The audit log: who did what, and what was refused. Rows are only ever added.

`table` has the rows, `acting` says who acts, `recording` adds an entry, `entries` reads them, and `refusals`
bounds the number of rows that strangers can cause.
"""
