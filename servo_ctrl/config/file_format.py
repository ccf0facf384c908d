"""The version of a file: the key `format`. What has none is of version 1; docs/upgrades.md."""

FORMAT = 1
"""Of every kind of file so far; a kind whose keys change their meaning gets a number of its own."""
ADVICE = "update this software, or use the one that wrote the file"


def format_problem(found: object, known: int = FORMAT) -> str:
    """Why a file with this `format` is not read, and what to do; "" when it is. None: it has no such key."""
    if found is None or (type(found) is int and 1 <= found <= known):
        return ""
    if type(found) is int and found > known:
        return f"has format {found}, this software reads up to {known}: {ADVICE}"
    return f"format {str(found)[:40]!r} is no whole number from 1 on"
