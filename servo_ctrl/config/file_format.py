"""The version of a file: the key `format`; a file without it has version 1. See docs/upgrades.md."""

FORMAT = 1
"""Version of every kind of file so far; a kind whose keys change their meaning gets its own number."""
ADVICE = "update this software, or use the one that wrote the file"


def format_problem(version: object, newest: int = FORMAT) -> str:
    """Return why a file with this `format` (None = no such key) cannot be read, and what to do; else ""."""
    if version is None or (type(version) is int and 1 <= version <= newest):
        return ""
    if type(version) is int and version > newest:
        return f"has format {version}, this software reads up to {newest}: {ADVICE}"
    return f"format {str(version)[:40]!r} is not a whole number from 1 on"
