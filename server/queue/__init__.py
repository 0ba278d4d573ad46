"""The queue between worker and browser (docs/queue.md draws its states).

The parent's side leases queries (`leases`) and answers them (`answers`). The worker's side (`worker_side`)
posts queries and takes answers and operator events. `queue_parent` is the parent that the agent sees. All SQL
that writes queries and answers is in this package; lists and pages are read in `server.reads`.
"""
