"""The directory that `servo-ctrl run --record` writes."""

from pathlib import Path

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.formats.table import Column, Table
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError


def read(path: Path) -> Table:
    """All columns with their units. Raises ReconcileError."""
    try:
        recording = load_recording(path)
        channels = recording.header.get("channels", {}).items()
        units = {name: str(channel["unit"]) for name, channel in channels}
    except RecordingError as error:
        raise ReconcileError(path, "", str(error).removeprefix(f"{path}: ")) from error
    except (KeyError, TypeError, AttributeError) as error:
        raise ReconcileError(path, "recording.json", f"is not the header of a recording: {error}") from error
    columns = {
        name: Column(values.astype(np.float64), units.get(name, ""))
        for name, values in recording.columns.items()
    }
    return Table(str(path), columns)
