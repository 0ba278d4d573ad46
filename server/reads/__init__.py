"""What pages, API and replay read from the database. Nothing here writes."""
