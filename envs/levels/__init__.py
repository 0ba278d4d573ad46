"""The worlds as data: a file a world, with its art, legend, brief, defaults and level rules. No torch here."""
