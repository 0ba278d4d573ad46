"""Access: who calls (sessions, tokens, the local key), and what each role may do (the matrix)."""
