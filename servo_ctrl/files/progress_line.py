"""A line of `--progress json`: what a program prints at each step for another program, such as the page."""

import json

FORMAT = 1
"""Version of the lines; a reader of another version must refuse them."""


def progress_line(step: str, done: int, of: int) -> str:
    """Return the line: `step` begins, `done` of `of` steps have ended or were omitted."""
    return json.dumps({"format": FORMAT, "step": step, "done": done, "of": of})
