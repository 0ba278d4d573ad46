"""The examination of an installation by `parenting doctor`: each part says what it found and what helps.

`machine` looks at what runs, `files` at the data folder and the database's file, `server` at PostgreSQL,
`store` at the tables, and `rows` at what is in them. No part changes anything, and whatever a part meets is a
finding, never an end of the examination.
"""
