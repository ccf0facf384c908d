"""`servo-ctrl export`: write a recording as CSV."""

from pathlib import Path
from typing import Annotated

import typer


def export(
    recording: Annotated[Path, typer.Argument(help="Recording directory, finished or torn off.")],
    csv: Annotated[Path, typer.Option(help="CSV file to write; one header line with the column names.")],
) -> None:
    """Write a recording as CSV; the columns are described in docs/recordings.md.

    Example:  servo-ctrl export out/circles --csv circles.csv
    """
    from servo_ctrl.errors import reason_of
    from servo_ctrl.files.arrow import write_csv
    from servo_ctrl.recording.reader import load_recording
    from servo_ctrl.recording.recorder import RecordingError

    loaded = load_recording(recording)
    try:
        write_csv(csv, loaded.columns)
    except OSError as error:
        raise RecordingError(f"{csv}: cannot be written: {reason_of(error)}") from None
    rows = len(loaded.columns["time_s"])
    typer.echo(f"{csv}: {rows} rows, {len(loaded.columns)} columns")
