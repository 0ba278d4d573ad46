"""Exports of format 2: whole runs as a folder or a zip of tables, which other programs and databases read.

`columns` describes every column once; `rows` reads them from the database, on one snapshot; `tables` writes
them as JSON lines, CSV and Parquet; `target` is the folder or the zip; `writing` puts all together, with
`manifest` and `codebook`.
"""
