"""How fast the agent is. Nothing imports these files; each is a command of its own."""
