"""The command line, one file a command. The top layer: it alone knows both experiments and server."""
