"""Parents that answer by a rule or from a record. The agent never imports this folder."""
