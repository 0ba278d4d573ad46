"""The worlds as data: a file a world, with art, legend, brief, defaults and level rules. No torch here."""
