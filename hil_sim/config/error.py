"""The error that every reader of the simulator's files raises."""

from pathlib import Path


class ConfigError(Exception):
    """A file that cannot be used; names the file, the key and the reason in one line for the user."""

    def __init__(self, file: Path, key: str, reason: str) -> None:
        super().__init__(f"{file}: {key}: {reason}" if key else f"{file}: {reason}")
        self.file = file
        self.key = key
        self.reason = reason
