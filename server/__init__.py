"""People: the only folder that knows HTTP and SQL. `server.app` and all that it reaches never loads torch."""
