"""What a page shows of an agent's policy: snapshots that the worker stores as the agent lives."""
