"""Recordings of any origin as one table of columns; one format a file."""
