"""The version of a file: the key `format`; a file without it has version 1. See docs/upgrades.md."""

FORMAT = 1
"""Version of every kind of file so far; a kind whose keys change their meaning gets its own number."""
ADVICE = "update this software, or use the one that wrote the file"


def format_problem(found: object, known: int = FORMAT) -> str:
    """Return why a file with this `format` (None = no such key) is not read, and what to do; else ""."""
    if found is None or (type(found) is int and 1 <= found <= known):
        return ""
    if type(found) is int and found > known:
        return f"has format {found}, this software reads up to {known}: {ADVICE}"
    return f"format {str(found)[:40]!r} is no whole number from 1 on"
