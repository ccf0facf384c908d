"""A saved capture is a recording: both readers, servo_ctrl's and reconcile's, find every row in it."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow.csv
import pytest
from matplotlib.image import imread
from stub_link import StubLink

from reconcile.formats.arrow_files import read_parquet
from reconcile.formats.readers import read_directory
from servo_ctrl.hmi.scope.appearance import ShownChannel, channel_unit
from servo_ctrl.hmi.scope.capture_files import CSV_FILE, PART_FILE, PICTURE_FILE, save_capture
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.units import MM
from servo_ctrl.recording.reader import load_recording
from servo_ctrl.recording.recorder import RecordingError

TAKEN = datetime(2026, 1, 2, 3, 4, 5, 678_000, tzinfo=UTC)


def capture_of(link: StubLink, cycles: int) -> tuple[CapturedRows, list[ShownChannel]]:
    link.advance(cycles)
    first, values = link.rows.since(0)
    names = ("x.position_command_m", "x.position_error_m", "y.position_error_m")
    channels = [ShownChannel(name, link.rows.place(name), channel_unit(name, "m", MM)) for name in names]
    return CapturedRows(first, values), channels


def test_a_saved_capture_is_read_back_row_by_row(tmp_path: Path) -> None:
    link = StubLink()
    rows, channels = capture_of(link, 2500)
    rows.values[3, link.rows.place("y.statusword")] = np.nan
    directory = save_capture(tmp_path, link.hello, rows, channels, origin=1000, taken=TAKEN)
    assert directory.name == "scope-20260102T030405-678"
    recording = load_recording(directory)
    assert recording.axes == ("x", "y")
    for place, name in enumerate(link.rows.names):
        expected = rows.values[:, place].copy()
        if name == "y.statusword":
            expected[3] = 0.0
        np.testing.assert_array_equal(recording.columns[name], expected)
    for table in (read_directory(directory), read_parquet(directory / PART_FILE)):
        column = table.columns["x.scale_position_m"]
        assert column.unit == "m"
        np.testing.assert_array_equal(column.values, rows.values[:, link.rows.place("x.scale_position_m")])
    assert pyarrow.csv.read_csv(directory / CSV_FILE).column_names == list(link.rows.names)
    picture = imread(directory / PICTURE_FILE)
    assert picture.shape[1] > 800
    assert picture.std() > 0.05


def test_an_empty_capture_is_refused(tmp_path: Path) -> None:
    link = StubLink()
    with pytest.raises(RecordingError, match="nothing to save"):
        save_capture(tmp_path, link.hello, CapturedRows(0, np.zeros((0, 27))), [], origin=0, taken=TAKEN)


def test_an_unwritable_directory_is_named(tmp_path: Path) -> None:
    link = StubLink()
    rows, channels = capture_of(link, 10)
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="file"):
        save_capture(tmp_path / "file", link.hello, rows, channels, origin=0, taken=TAKEN)
