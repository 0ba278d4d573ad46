"""Reads of the database for pages, API, export and replay. Nothing here writes."""
