"""The public Python interface, `import parenting as pt`: the names that `parenting/__init__.py` lists."""
