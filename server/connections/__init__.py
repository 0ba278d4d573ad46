"""Bounds of connections, below the application: how many, how long, how many bytes before a request is whole.

uvicorn parses requests; it bounds neither the head nor the number of connections, and has no deadlines but
for keep-alive. `protocol` is its protocol with these bounds, `limits` holds the numbers and counts
connections, `files` raises the limit of open files.
"""
