"""The log of who started, cancelled or accepted what on a page."""

import json
import os
from datetime import UTC, datetime
from pathlib import Path

from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.recording.command_log import append_line


def log_action(log: Path, who: str, what: str, details: dict[str, object]) -> None:
    """Append to a log who did what and when, one JSON object a line. Raises OSError."""
    moment = datetime.now(UTC).isoformat(timespec="milliseconds")
    entry = {"format": FORMAT, "time": moment, "who": who, "what": what, **details}
    log.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(log, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o600)
    try:
        append_line(descriptor, json.dumps(entry, default=str).encode() + b"\n")
    finally:
        os.close(descriptor)
